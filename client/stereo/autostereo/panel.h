// Describes an autostereo display: its pixels, and the line screen before them.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>

#include "client/stereo/mode.h"
#include "common/core/result.h"
#include "common/geometry/stereo.h"

namespace telesplat::stereo {

/// A line screen before a display: a parallax barrier (opaque, with slits) or a sheet of cylindrical lenses. Light from
/// a place of the display reaches an eye through it or not, and that decides which eye's picture belongs there (Sandin
/// et al. 2005).
///
/// Lengths are metres on the display's own axes: x to the right and y up from its middle, z towards the person; pixels
/// lie at z = 0. Air lies before them, `gap_m` thick, then a plate of `thickness_m` with refractive index `index`; the
/// lines are on its far side. The order of air and plate makes no difference.
///
/// Line k is where (x cos tilt + y sin tilt - shift) / pitch = k, so lines lean to the left with a tilt above 0. It is
/// the middle of a barrier's slit, or of a lens. A lens makes the light of a place parallel (the display lies in its
/// focal plane), in the direction of the ray through its middle: so light passes there as through a slit, and one map
/// serves both.
struct LineScreen {
  double pitch_m = 0.9e-3;  ///< from line to line, across them
  double tilt_deg = 0;      ///< angle between the lines and the vertical
  double shift_m = 0;       ///< distance of line 0 from the display's middle, across the lines
  double gap_m = 0, thickness_m = 3e-3;
  double index = 1.5;     ///< refractive index of the plate
  double opening = 0.25;  ///< barrier: share of the pitch that is a slit; lenses: share of it that the light of a place
                          ///< covers seen from afar
  /// Guard band, as a share of the pitch: a place is black if both eyes' distances from the middle of a line differ by
  /// less than this. 0: no place is black.
  double guard = 0.05;
  bool operator==(const LineScreen&) const = default;
};

/// Error: names the value and its limits.
Status validate(const LineScreen& screen);

/// Returns where the eye's line of sight to a place of the display meets the plane of the lines, metres on the
/// display's axes. The plate refracts it (Snell's law). Precondition: the eye lies before the lines.
glm::dvec2 through(const LineScreen& screen, const glm::dvec3& eye, const glm::dvec2& place);

/// Converts a place in the plane of the lines to lines: a whole number is the middle of a line.
double line_at(const LineScreen& screen, const glm::dvec2& in_plane);

/// Distance from the middle of the nearest line, 0 to 0.5 lines.
double off_line(double line);

/// Thickness of air that shifts paraxial rays as much as gap and plate do.
double optical_depth_m(const LineScreen& screen);

enum class Shown { kNothing, kLeft, kRight };
/// Returns the eye whose picture belongs to a place. left_off, right_off: off_line() of each eye's line of sight to it.
Shown whose(const LineScreen& screen, double left_off, double right_off);

/// Order of a pixel's colours from left to right.
enum class Subpixels {
  kRgb,
  kBgr,
  kWhole  ///< all colours at one place: whole pixels belong to one eye
};

struct Panel {
  int width = 2560, height = 1600;  ///< pixels
  double pixel_m = 0.25e-3;         ///< from pixel to pixel, both ways
  Subpixels subpixels = Subpixels::kRgb;
  Size eye{};               ///< size of one eye's picture; 0: as many pixels as the display has
  double distance_m = 0.7;  ///< distance of a person whose head is not tracked
  LineScreen lines;
  bool operator==(const Panel&) const = default;

  double width_m() const { return width * pixel_m; }
  double height_m() const { return height * pixel_m; }
  Size eye_size() const { return eye.width > 0 ? eye : Size{width, height}; }
};

/// Error: names the value and its limits.
Status validate(const Panel& panel);

/// The eyes' places on the panel's axes (LineScreen).
using Eyes = std::array<glm::dvec3, 2>;
/// Eyes straight before the panel's middle.
Eyes eyes_before(const Panel& panel, double separation_m, double distance_m);
/// Returns the places of eyes whose cameras see through a window that is the panel. The window is scaled to the panel's
/// width, so its size in the room does not matter.
Eyes eyes_of(const Panel& panel, const std::array<geometry::Camera, 2>& cameras);
/// Error: an eye is nearer than nearest_eye_m(), or farther than 100 m.
Status validate(const Panel& panel, const Eyes& eyes);
/// Least distance of an eye from the display's pixels, metres: 0.05, or 0.01 beyond the plate.
double nearest_eye_m(const Panel& panel);

/// Returns the middle of a subpixel on the panel's axes. subpixel: 0 to 2 from left to right; 1 is the pixel's middle.
glm::dvec2 place_of(const Panel& panel, int x, int y, int subpixel);
/// Bit shifts of the subpixels' colours, from left to right; 16: red, 8: green, 0: blue.
std::array<int, 3> shifts_of(Subpixels subpixels);

/// Figures of a panel, for people.
struct PanelFigures {
  double best_distance_m = 0;  ///< distance at which both eyes see neighbouring halves of what lies behind a line
  double repeat_m = 0;         ///< step to the side after which the picture repeats, at distance_m
  double pixels_a_line = 0;    ///< pixels from line to line, across the picture
  double crosstalk = 0;        ///< share of an eye's light that is meant for the other one, if eyes are tracked
  double dark = 0;             ///< share of subpixels in guard bands
};
/// Computes them for eyes straight before the panel at distance_m. crosstalk and dark are counted over its middle.
PanelFigures figures_of(const Panel& panel, double separation_m);

}  // namespace telesplat::stereo
