#include "client/stereo/autostereo/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "client/stereo/autostereo/interleaver.h"

namespace telesplat::stereo {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr int kSteps = 4;  // steps of Newton's method; the first guess is the paraxial one

constexpr double kPanelDegree = 3.14159265358979323846 / 180;

}  // namespace

Status validate(const LineScreen& s) {
  const auto limits = [](const char* name, double value, double least, double most) -> Status {
    if (value >= least && value <= most) return ok_status();
    return Error{fmt::format("{} is {}, limits are {} and {}", name, value, least, most)};
  };
  for (const auto& good : {limits("pitch_mm", s.pitch_m * 1e3, 0.01, 100), limits("tilt_deg", s.tilt_deg, -60, 60),
                           limits("shift_mm", s.shift_m * 1e3, -1e4, 1e4), limits("gap_mm", s.gap_m * 1e3, 0, 1000),
                           limits("thickness_mm", s.thickness_m * 1e3, 0, 1000), limits("index", s.index, 1, 3),
                           limits("opening", s.opening, 0.01, 0.9), limits("guard", s.guard, 0, 0.49)})
    if (!good) return good;
  if (s.gap_m + s.thickness_m <= 0)
    return Error{"gap_mm and thickness_mm are both 0: lines that lie in the pixels part nothing"};
  return ok_status();
}

glm::dvec2 through(const LineScreen& s, const glm::dvec3& eye, const glm::dvec2& place) {
  const glm::dvec2 aside = glm::dvec2(eye) - place;
  const double distance = glm::length(aside), air_m = eye.z - s.thickness_m;
  // tangent is that of the ray's angle in air. In the plate the sine is 1 / index of that in air, so the tangent there
  // is tan / sqrt(index^2 + (index^2 - 1) tan^2).
  const double n2 = s.index * s.index;
  double tangent = distance / (air_m + s.thickness_m / s.index);
  for (int i = 0; i < kSteps; ++i) {
    const double root = std::sqrt(n2 + (n2 - 1) * tangent * tangent);
    const double reached = air_m * tangent + s.thickness_m * tangent / root;
    const double slope = air_m + s.thickness_m * n2 / (root * root * root);
    tangent -= (reached - distance) / slope;
  }
  const double behind_m = s.gap_m * tangent + s.thickness_m * tangent / std::sqrt(n2 + (n2 - 1) * tangent * tangent);
  return distance > 0 ? place + aside * (behind_m / distance) : place;
}

double line_at(const LineScreen& s, const glm::dvec2& p) {
  const double tilt = s.tilt_deg * kDegree;
  return (p.x * std::cos(tilt) + p.y * std::sin(tilt) - s.shift_m) / s.pitch_m;
}

double off_line(double line) { return std::abs(line - std::nearbyint(line)); }

double optical_depth_m(const LineScreen& s) { return s.gap_m + s.thickness_m / s.index; }

Shown whose(const LineScreen& s, double left_off, double right_off) {
  if (std::abs(left_off - right_off) < s.guard) return Shown::kNothing;
  return left_off <= right_off ? Shown::kLeft : Shown::kRight;
}

Status validate(const Panel& p) {
  const auto sides = [](const char* name, int width, int height) -> Status {
    for (const int side : {width, height})
      if (side < 1 || side > geometry::kMaxImageSide)
        return Error{fmt::format("{} is {} x {}, limits are 1 and {}", name, width, height, geometry::kMaxImageSide)};
    return ok_status();
  };
  if (const Status s = sides("pixels", p.width, p.height); !s) return s;
  if (const Status s = sides("eye", p.eye_size().width, p.eye_size().height); !s) return s;
  if (!(p.pixel_m >= 1e-6 && p.pixel_m <= 0.1))
    return Error{fmt::format("pixel_mm is {}, limits are 0.001 and 100", p.pixel_m * 1e3)};
  if (!(p.distance_m >= 0.05 && p.distance_m <= 100))
    return Error{fmt::format("distance_m is {}, limits are 0.05 and 100", p.distance_m)};
  if (const Status s = validate(p.lines); !s) return s;
  return validate(p, eyes_before(p, 0, p.distance_m));
}

Eyes eyes_before(const Panel&, double separation_m, double distance_m) {
  return {glm::dvec3(-0.5 * separation_m, 0, distance_m), glm::dvec3(0.5 * separation_m, 0, distance_m)};
}

Eyes eyes_of(const Panel& panel, const std::array<geometry::Camera, 2>& cameras) {
  Eyes out;
  for (size_t i = 0; i < 2; ++i) {
    const geometry::Camera& c = cameras[i];
    const double z = panel.width_m() / (c.right - c.left);
    out[i] = {-0.5 * (c.left + c.right) * z, -0.5 * (c.bottom + c.top) * z, z};
  }
  return out;
}

double nearest_eye_m(const Panel& panel) { return std::max(0.05, panel.lines.gap_m + panel.lines.thickness_m + 0.01); }

Status validate(const Panel& panel, const Eyes& eyes) {
  const double least = nearest_eye_m(panel) - 1e-9;
  for (const glm::dvec3& eye : eyes)
    if (!(eye.z >= least && eye.z <= 100))
      return Error{fmt::format("an eye is {:.3f} m before the display, limits are {:.2f} and 100", eye.z, least)};
  return ok_status();
}

glm::dvec2 place_of(const Panel& p, int x, int y, int subpixel) {
  const double within = p.subpixels == Subpixels::kWhole ? 0.5 : (subpixel + 0.5) / 3;
  return {(x + within - 0.5 * p.width) * p.pixel_m, (0.5 * p.height - y - 0.5) * p.pixel_m};
}

std::array<int, 3> shifts_of(Subpixels subpixels) {
  if (subpixels == Subpixels::kBgr) return {0, 8, 16};
  return {16, 8, 0};
}

PanelFigures figures_of(const Panel& p, double separation_m) {
  PanelFigures out;
  const double depth_m = optical_depth_m(p.lines),
               pitch_x_m = p.lines.pitch_m / std::cos(p.lines.tilt_deg * kPanelDegree);
  // At distance z from the pixels, eyes e apart see a place through the lines e * depth / z apart: half a pitch is
  // best.
  out.best_distance_m = separation_m * depth_m / (0.5 * pitch_x_m);
  out.repeat_m = pitch_x_m * p.distance_m / depth_m;
  out.pixels_a_line = pitch_x_m / p.pixel_m;
  const Eyes eyes = eyes_before(p, separation_m, p.distance_m);
  const SeenShares shares = seen_shares(p, eyes);
  out.crosstalk = shares.crosstalk;
  out.dark = shares.dark;
  return out;
}

}  // namespace telesplat::stereo
