// An autostereo display: its pixels, and the line screen before them.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>

#include "client/stereo/mode.h"
#include "common/core/result.h"
#include "common/geometry/stereo.h"

namespace telesplat::stereo {

/// A line screen before a display: a parallax barrier (opaque, with slits) or a sheet of cylindrical lenses. From
/// each place of the display light reaches an eye through it or not, and that decides which eye's picture belongs
/// there (Sandin et al. 2005).
///
/// Lengths are metres on the display's own axes: x to the right and y up from its middle, z towards the person;
/// pixels lie at z = 0. Next to them comes air, `gap_m` thick, then a plate of `thickness_m` with refractive index
/// `index`; the lines lie on its far side. Which of the two comes first makes no difference.
///
/// Line k is where (x cos tilt + y sin tilt - shift) / pitch = k, so lines lean to the left with a tilt above 0. Of
/// a barrier it is the middle of a slit, of lenses that of a lens: there the light of a place passes as through a
/// slit, because the lens makes it parallel (the display lies in its focal plane) in the direction of the ray
/// through its middle. So one map serves both.
struct LineScreen {
  double pitch_m = 0.9e-3;  ///< from line to line, across them
  double tilt_deg = 0;      ///< of the lines against the vertical
  double shift_m = 0;       ///< of line 0 from the display's middle, across the lines
  double gap_m = 0, thickness_m = 3e-3;
  double index = 1.5;     ///< refractive, of the plate
  double opening = 0.25;  ///< of a barrier: how much of the pitch is a slit; of lenses: how much of it the light of a
                          ///< place covers seen from afar
  /// Guard band: where an eye's line of sight is nearer to the middle of a line than the other eye's by less than this
  /// share of the pitch, nothing is shown. 0: none.
  double guard = 0.05;
  bool operator==(const LineScreen&) const = default;
};

/// Error: names the value and its limits.
Status validate(const LineScreen& screen);

/// Where the eye's line of sight to a place of the display meets the plane of the lines, metres on the display's axes;
/// the plate refracts it (Snell's law). Precondition: the eye lies before the lines.
glm::dvec2 through(const LineScreen& screen, const glm::dvec3& eye, const glm::dvec2& place);

/// A place in the plane of the lines, in lines: a whole number in the middle of one.
double line_at(const LineScreen& screen, const glm::dvec2& in_plane);

/// How far from the middle of the nearest line, 0 to 0.5 lines.
double off_line(double line);

/// The distance from the lines, paraxially, that air of this depth would have.
double optical_depth_m(const LineScreen& screen);

enum class Shown { kNothing, kLeft, kRight };
/// Whose picture belongs to a place that the eyes see at these distances from the middles of lines.
Shown whose(const LineScreen& screen, double left_off, double right_off);

/// How a pixel's colours lie in it, from left to right.
enum class Subpixels {
  kRgb,
  kBgr,
  kWhole  ///< in one place: whole pixels are shared out
};

struct Panel {
  int width = 2560, height = 1600;  ///< pixels
  double pixel_m = 0.25e-3;         ///< from pixel to pixel, both ways
  Subpixels subpixels = Subpixels::kRgb;
  Size eye{};               ///< the picture of one eye; 0: as many pixels as the display has
  double distance_m = 0.7;  ///< of a person before it whose head is not tracked
  LineScreen lines;
  bool operator==(const Panel&) const = default;

  double width_m() const { return width * pixel_m; }
  double height_m() const { return height * pixel_m; }
  Size eye_size() const { return eye.width > 0 ? eye : Size{width, height}; }
};

/// Error: names the value and its limits.
Status validate(const Panel& panel);

/// Where the eyes are on the panel's axes (LineScreen).
using Eyes = std::array<glm::dvec3, 2>;
/// Straight before its middle.
Eyes eyes_before(const Panel& panel, double separation_m, double distance_m);
/// Of eyes whose cameras see through a window that is the panel: where they are to it. The window's width is that of
/// the panel, whatever it is in the room.
Eyes eyes_of(const Panel& panel, const std::array<geometry::Camera, 2>& cameras);
/// Error: an eye is behind the lines or not before the panel, within 0.05 m and 100 m.
Status validate(const Panel& panel, const Eyes& eyes);
/// How far before the display's pixels an eye is at least, metres: beyond the plate.
double nearest_eye_m(const Panel& panel);

/// Middle of a subpixel on the panel's axes. subpixel: 0 to 2 from left to right; 1 is the pixel's middle.
glm::dvec2 place_of(const Panel& panel, int x, int y, int subpixel);
/// Bits of the colour of a subpixel, from left to right; 16: red, 8: green, 0: blue.
std::array<int, 3> shifts_of(Subpixels subpixels);

/// What its figures come to, for people.
struct PanelFigures {
  double best_distance_m = 0;  ///< where eyes of that separation see neighbouring halves of what lies behind a line
  double repeat_m = 0;         ///< at distance_m the picture repeats itself after so much to the side
  double pixels_a_line = 0;    ///< pixels from line to line, across the picture
  double crosstalk = 0;        ///< share of an eye's light that is meant for the other one, of eyes that are tracked
  double dark = 0;             ///< share of subpixels in guard bands
};
/// Eyes straight before it at distance_m. crosstalk and dark are counted over its middle.
PanelFigures figures_of(const Panel& panel, double separation_m);

}  // namespace telesplat::stereo
