// Small pictures that tell where one is: axes, a scale bar, what lies under the cursor, what was measured. No window,
// no session.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/viewer/hands/measurements.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// The data's axes x, y and z as the camera sees them, red, green and blue (with letters, for who cannot tell them
/// apart), those that point to the eye last. 0xAARRGGBB, `side` pixels.
image::View axes_picture(const geometry::Camera& camera, const SceneTerms& terms, int side);

/// A bar of a round length in the data's units, as long as it is seen at `depth_m`: at most `width` pixels. Nothing:
/// the depth is no depth.
struct ScaleBar {
  double length = 0;  ///< in units of the data: 1, 2 or 5 times a power of ten
  double pixels = 0;
  std::string text;  ///< "20 mm"
};
std::optional<ScaleBar> scale_bar(const geometry::Camera& camera, const SceneTerms& terms, double depth_m, int width);
/// scale: pixels a side of a letter's dot.
image::View scale_picture(const ScaleBar& bar, int scale);

/// A line of `thickness` pixels: those whose centres lie within half of it get the colour.
void draw_line(image::View& view, glm::dvec2 a, glm::dvec2 b, double thickness, uint32_t colour);

/// What lies under the cursor, a line each; without a pick one that says so.
std::vector<std::string> cursor_lines(const std::optional<scene::ToldPlace>& place, const SceneTerms& terms);

/// Depth of the middle of a box along the camera's axis, metres.
double middle_depth_m(const geometry::Camera& camera, const geometry::Box& box_room);

/// The part of the camera's picture that marks of the places lie in, with points, lines and labels on nothing
/// (0xAARRGGBB); x, y: of its upper left pixel. Empty: none is seen. scale: pixels a side of a letter's dot.
struct MarksPicture {
  image::View view;
  int x = 0, y = 0;
};
MarksPicture draw_marks(const Measurements& measurements, const geometry::Camera& camera, int scale);

}  // namespace telesplat::viewer
