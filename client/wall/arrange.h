// Screens that stand in rows and columns: on a plane, or on a cylinder around the head. Private to this library.
#pragma once

#include <string>
#include <vector>

#include "client/wall/wall.h"

namespace telesplat::wall {

/// Yaw about +y, then pitch about the turned x axis, then roll about the axis towards the viewer; degrees.
glm::dquat turned(double yaw_deg, double pitch_deg, double roll_deg);

/// What all screens of an arrangement have.
struct Panel {
  double width_m = 0, height_m = 0;
  int width = 0, height = 0;
  Bezel bezel;
  std::optional<std::pair<int, int>> sampling;
  /// From a screen's middle to the next one's, where they touch.
  double pitch_x() const { return width_m + bezel.left + bezel.right; }
  double pitch_y() const { return height_m + bezel.bottom + bezel.top; }
};

struct Grid {
  std::string name;  ///< for the names of its screens
  int columns = 1, rows = 1;
  Panel panel;
  int screens_per_node = 1;
  int first_node = 0;
};

/// Screens that touch, in the plane of `middle`, around its origin, which lies at `middle_m` of the wall unrolled.
std::vector<Screen> planar_grid(const Grid& grid, const geometry::Pose& middle, const glm::dvec2& middle_m);

struct Arc {
  glm::dvec3 centre{0.0};  ///< on the cylinder's axis, which is vertical, as high as the middle of its screens
  double radius_m = 0;     ///< from the axis to the middle of each picture
  double turn_deg = 0;     ///< where the middle column stands, to the left of straight on
  double column_deg = 0;   ///< from one column to the next; 0: outer edges touch
};
/// The angle of an arc whose screens touch, in degrees.
double touching_deg(const Panel& panel, double radius_m);
/// Columns of screens around the axis, which they face.
std::vector<Screen> cylindrical_arc(const Grid& grid, const Arc& arc);

}  // namespace telesplat::wall
