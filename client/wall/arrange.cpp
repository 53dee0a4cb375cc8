#include "client/wall/arrange.h"

#include <fmt/format.h>

#include <cmath>

namespace telesplat::wall {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

// Its place among the others is the caller's to fill in.
Screen screen_of(const Grid& grid, int row, int column) {
  const Panel& p = grid.panel;
  Screen s;
  s.name = fmt::format("{}, row {}, column {}", grid.name, row + 1, column + 1);
  s.width_m = p.width_m, s.height_m = p.height_m;
  s.width = p.width, s.height = p.height;
  s.bezel = p.bezel;
  s.sampling = p.sampling;
  s.node = grid.first_node + (row * grid.columns + column) / grid.screens_per_node;
  // The picture's middle, not that of the screen with its bezels.
  const glm::dvec2 off((p.bezel.left - p.bezel.right) / 2, (p.bezel.bottom - p.bezel.top) / 2);
  s.unrolled_m =
      glm::dvec2((column - (grid.columns - 1) / 2.0) * p.pitch_x(), ((grid.rows - 1) / 2.0 - row) * p.pitch_y()) + off;
  return s;
}

}  // namespace

glm::dquat turned(double yaw_deg, double pitch_deg, double roll_deg) {
  const auto about = [](double degrees, const glm::dvec3& axis) { return glm::angleAxis(degrees * kDegree, axis); };
  return about(yaw_deg, {0, 1, 0}) * about(pitch_deg, {1, 0, 0}) * about(roll_deg, {0, 0, 1});
}

std::vector<Screen> planar_grid(const Grid& grid, const geometry::Pose& middle, const glm::dvec2& middle_m) {
  std::vector<Screen> out;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      Screen s = screen_of(grid, row, column);
      s.pose = {middle.position_room + middle.orientation * glm::dvec3(s.unrolled_m, 0), middle.orientation};
      s.unrolled_m += middle_m;
      out.push_back(std::move(s));
    }
  return out;
}

double touching_deg(const Panel& panel, double radius_m) {
  return 2 * std::atan(panel.pitch_x() / 2 / radius_m) / kDegree;
}

std::vector<Screen> cylindrical_arc(const Grid& grid, const Arc& arc) {
  const double step = arc.column_deg > 0 ? arc.column_deg : touching_deg(grid.panel, arc.radius_m);
  std::vector<Screen> out;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      Screen s = screen_of(grid, row, column);
      const double across = (grid.panel.bezel.left - grid.panel.bezel.right) / 2;
      const glm::dquat turn = turned(arc.turn_deg - (column - (grid.columns - 1) / 2.0) * step, 0, 0);
      s.pose = {arc.centre + turn * glm::dvec3(across, s.unrolled_m.y, -arc.radius_m), turn};
      s.unrolled_m += glm::dvec2(-arc.turn_deg * kDegree * arc.radius_m, arc.centre.y);
      out.push_back(std::move(s));
    }
  return out;
}

}  // namespace telesplat::wall
