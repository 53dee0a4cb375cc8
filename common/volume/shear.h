// Splits a perspective view of a volume into a shear along a principal axis and a warp (T4.5.1, eq. 4.9-4.12).
//
// All in index coordinates of the grid, which is affine in room space, so lines stay lines. p is the principal axis, u
// = (p + 1) % 3 and v = (p + 2) % 3 the others. Seen from the eye e, a point x in front of it has
//   t = direction * (x_p - e_p) > 0,    slope_u = (x_u - e_u) / t,    slope_v = (x_v - e_v) / t,
// and the *raster* of the view is a regular grid of slopes, the same for every slice: pixel (x, y) has its centre at
//   slope_u = u0 + (x + 0.5) * du,    slope_v = v0 + (y + 0.5) * dv.
// A slice (x_p = s, so one t) is therefore only scaled by 1 / (t du), 1 / (t dv) pixels a voxel and translated, as in
// eq. 4.11-4.12 with the compositing plane at x_p = 0 (tests compare both). A ray of the sampled eye goes through the
// same pixel in every slice.
//
// Consecutive slices, front to back, make a *layer*: one slice image, which represents the plane x_p = Layer::plane.
// Planes do not matter for the sampled eye; from elsewhere they give the parallax (T4.5.2, the intermediate volume).
// All samplers cut layers in the same way, for any slabs they hold.
#pragma once

#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/volume/grid.h"

namespace telesplat::volume {

inline constexpr int kMaxLayers = 64;
inline constexpr int kMaxRasterSide = 4096;

/// Slices [begin, end) of axis p, in index order for either direction; not empty.
struct Layer {
  int begin = 0, end = 0;
  double plane = 0;  ///< index coordinate of its image along p
  bool operator==(const Layer&) const = default;
};

struct ShearFrame {
  int axis = 2;         ///< p: 0, 1 or 2
  int direction = 1;    ///< +1: slices of higher index are farther; -1: nearer
  glm::dvec3 eye{0.0};  ///< e, index coordinates
  double u0 = 0, du = 1, v0 = 0, dv = 1;
  int width = 1, height = 1;  ///< size of the raster, pixels
  std::vector<Layer> layers;  ///< front to back, seen from e; they do not overlap or reach behind the eye

  bool operator==(const ShearFrame&) const = default;

  int u() const { return (axis + 1) % 3; }
  int v() const { return (axis + 2) % 3; }
  /// t of a plane x_p = `at`; above 0 in front of the eye.
  double t(double at) const { return direction * (at - eye[axis]); }
  /// Index coordinates of continuous raster position (x, y), with pixel centres at + 0.5, on the plane x_p = `at`.
  glm::dvec3 unproject(double x, double y, double at) const;
  /// Length of the ray through continuous raster position (x, y) from one slice to the next, in units of
  /// Grid::unit_m().
  double path(const Grid& grid, double x, double y) const;
};

/// Refuses frames that plan_frame cannot make: axes, directions, sizes, pitches, layers out of range or order, behind
/// or too near the eye.
Status validate(const ShearFrame& frame, const Grid& grid);

struct PlanOptions {
  int layers = 16;  ///< at most; fewer if there are fewer slices
  /// A raster pixel is at least this part of a voxel, at the distance of the nearest slice in view or at 0.4 times the
  /// farthest one's distance, the larger of the two.
  double finest = 0.3;
  double near_slices = 1;  ///< slices nearer to the eye than this many are left out
};

/// Plans the view of `cameras` (at least one; all near the same place), sampled from cameras[0]'s eye. The principal
/// axis is the one closest to their rays through the grid, for an eye outside the grid or inside. The raster covers the
/// part of the grid's box that any camera sees, and a pixel more on every side; its pixels are as large as cameras[0]'s
/// where it sees the grid's nearest part. Nothing: no camera sees the grid.
std::optional<ShearFrame> plan_frame(const Grid& grid, std::span<const geometry::Camera> cameras,
                                     const PlanOptions& options = {});

/// The warp (T eq. 4.9, M_warp) of the image on the plane x_p = `plane` of `frame`, from display pixels to raster
/// positions: (x w, y w, w) = M (px, py, 1), both continuous with pixel centres at + 0.5. A display ray meets the plane
/// in front of the camera's eye if w > 0. Nothing: the eye lies in the plane.
std::optional<glm::dmat3> warp(const Grid& grid, const ShearFrame& frame, double plane,
                               const geometry::Camera& display);

/// Raster rows (axis 0) or columns (axis 1) [first, second) of the plane x_p = `slice` (whole for a slice, or between
/// two) whose index coordinate k lies in [k_begin - 0.5, k_end - 0.5): the part of a slice that a slab of voxels
/// [k_begin, k_end) owns. The slabs at the grid's ends also own the part beyond. Every pixel of a slice belongs to
/// exactly one slab, so that slabs meet without a seam. Precondition: axis != 2, t(slice) > 0.
std::pair<int, int> owned_pixels(const Grid& grid, const ShearFrame& frame, double slice, int k_begin, int k_end);

}  // namespace telesplat::volume
