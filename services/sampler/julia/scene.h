// A quaternion Julia set, prepared for tracing rays: constants in single precision, and the rays of a camera in the
// set's own coordinates.
//
// The orbit of q under f(q) = q^2 + c never leaves the three-dimensional space that 1, the vector part of c and the
// vector part of q span, since q^2 = (w^2 - |v|^2) + 2 w v. With w = Re q, p the component of v along c's vector part
// and r its length across it, f is
//   w' = w^2 - p^2 - r^2 + Re c          p' = 2 w p + |v(c)|          r' = 2 w r
// and only R = r^2 is needed: R' = 4 w^2 R. All three are kept doubled (2w, 2p, 4R), which saves multiplications:
//   N = W + (P + R), W = w^2, P = p^2     w' = (W - N / 2) + 2 Re c    p' = w p + 2 |v(c)|    R' = W R
// with N = 4 |q|^2, and |f^n'|^2 is the product of the N before. *Orbit coordinates* are (2w, 2p, 2r1, 2r2), r1 and r2
// the components of v in two directions across c's: an affine function of set space, hence of a ray's depth.
//
// The distance estimate is 0.5 |q| log|q| / |q'| = sqrt(N / D) log(N / 4) / 8 at the first N > limit, D = |q'|^2; 0
// inside. Source: Hart, Sandin, Kauffman, "Ray tracing deterministic 3-D fractals", SIGGRAPH 1989.
#pragma once

#include <array>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/clip.h"
#include "common/julia/parameters.h"

namespace telesplat::sampler {

class JuliaScene {
 public:
  /// The palette index must be one of julia::palette_names(). An orbit counts as escaped no sooner than it must escape:
  /// the bailout used is the larger of the one given and 1.01 julia::radius(c),
  /// so that an escaped orbit never comes back, even with rounding.
  /// clip: cuts parts away; the cut through the set is shown.
  JuliaScene(const julia::Parameters& parameters, const julia::Placement& placement, const geometry::Clip& clip = {});

  /// Constants for the kernels. Lengths in set units, room space in metres.
  struct Constants {
    float c_w, c_p;                ///< 2 Re c, 2 |v(c)|
    float limit;                   ///< 4 bailout^2
    int iterations;                ///< at most
    float radius;                  ///< radius of the ball about 0 that holds the set
    float lod;                     ///< the surface is where the estimate is this many footprints
    float box_lo[3], box_hi[3];    ///< room space
    float axes[3][4];              ///< orbit coordinates gained along X, Y, Z
    float plane[3];                ///< twice the j component of q = plane . (2p, 2r1, 2r2)
    int colour;                    ///< julia::Colour
    float tone_scale, tone_shift;  ///< tone = length / (2 radius) tone_scale + tone_shift, lengths doubled
    float ambient, shadow;
    float light[3];  ///< towards the light, unit length
    int planes;      ///< number of the clip's planes
    float plane_normal[geometry::Clip::kMostPlanes][3], plane_offset[geometry::Clip::kMostPlanes];  ///< room space
    float units_per_metre;                                                                          ///< set units
  };
  const Constants& constants() const { return constants_; }

  /// Orbit coordinates of a room-space point, or of a direction in room space.
  glm::dvec4 orbit_point(const glm::dvec3& room) const;
  glm::dvec4 orbit_direction(const glm::dvec3& room) const;

  /// Set units a metre.
  double units_per_metre() const { return units_per_metre_; }
  int palette() const { return palette_; }

 private:
  Constants constants_;
  std::array<glm::dvec4, 3> axes_;  // orbit coordinates gained along X, Y, Z
  glm::dvec4 origin_;               // orbit coordinates of set-space 0
  glm::dvec3 centre_;
  double units_per_metre_;
  int palette_;
};

/// Side of the square blocks for which cones are marched, pixels. The blocks lie on a grid fixed to the whole image,
/// so that a pixel's result does not depend on the rectangle it was asked for with.
inline constexpr int kJuliaBlock = 8;

/// The rays of a camera through a scene. footprint_px: size of a footprint in pixels of this camera. A ray's parameter
/// t is depth in metres; the direction of pixel (x, y) is column[x] + row[y], in orbit coordinates (index 0 to 3) and
/// in room space (4 to 6). Only the blocks that `rect` touches are filled.
struct JuliaRays {
  JuliaRays(const JuliaScene& scene, const geometry::Camera& camera, const geometry::Rect& rect, double footprint_px);

  int x0, y0;  ///< upper left pixel of the blocks that hold the rectangle
  int columns_of_blocks, rows_of_blocks;
  float origin[7];  ///< origin of all rays: orbit coordinates, room space
  float near_m;
  float footprint;     ///< footprint_px pixels, in set units a metre of depth
  float ball;          ///< radius in orbit coordinates of the ball about 0 that rays are clipped to
  float spread;        ///< distance of a block's farthest ray from its middle one, in set units a metre of depth
  float block_ball;    ///< as `ball`, for a block's middle ray to stand for all its rays
  float block_margin;  ///< metres that the box grows by, likewise
  std::array<std::vector<float>, 7> column, row;              ///< for pixels, from (x0, y0)
  static constexpr int kPadding = 16;                         ///< additional columns at the right, for whole vectors
  std::array<std::vector<float>, 7> block_column, block_row;  ///< for the blocks' middles
};

}  // namespace telesplat::sampler
