// A line screen before a display: a parallax barrier (opaque, with slits) or a sheet of cylindrical lenses. From each
// place of the display light reaches an eye through it or not, and that decides which eye's picture belongs there
// (Sandin et al. 2005).
//
// Lengths are metres on the display's own axes: x to the right and y up from its middle, z towards the person; pixels
// lie at z = 0. Next to them comes air, `gap_m` thick, then a plate of `thickness_m` with refractive index `index`; the
// lines lie on its far side. Which of the two comes first makes no difference.
//
// Line k is where (x cos tilt + y sin tilt - shift) / pitch = k, so lines lean to the left with a tilt above 0. Of a
// barrier it is the middle of a slit, of lenses that of a lens: there the light of a place passes as through a slit,
// because the lens makes it parallel (the display lies in its focal plane) in the direction of the ray through its
// middle. So one map serves both.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "common/core/result.h"

namespace telesplat::stereo {

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

}  // namespace telesplat::stereo
