// The picture of a draw list's coarse points: drawn at a quarter of the resolution or less, and shown in pixels that
// the other points leave empty. Coarse points are too far apart for splats of full resolution.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/camera.h"
#include "common/splat/finish.h"

namespace telesplat::splat {

/// A backdrop has a quarter to a sixteenth of the picture's pixels a side.
inline constexpr int kLeastHalvings = 2, kMostHalvings = 4;

/// The camera of a backdrop: each of its pixels covers 2^halvings x 2^halvings pixels of the picture.
inline geometry::Camera backdrop_camera(geometry::Camera camera, int halvings) {
  for (int n = 0; n < halvings; ++n) camera = geometry::half_size(camera);
  return camera;
}

/// Chooses a model's points for the backdrop of a picture, and its resolution: splats are a few pixels wide.
/// options: those of the picture.
void select_coarse(const points::PointModel& model, const geometry::Camera& camera, const SelectionOptions& options,
                   DrawList& out);

struct Backdrop {
  geometry::Camera camera;
  int halvings = kLeastHalvings;
  std::vector<uint32_t> colour;  ///< 0xffRRGGBB
  std::vector<float> depth_m;    ///< +infinity: empty
  std::vector<uint8_t> whole;    ///< 1: the pixel, the next one, and those below them are covered
  /// Finds `whole`.
  void find_whole();
};

/// Kernel and finish of backdrops.
inline constexpr RenderOptions kBackdrop{.kernel = Kernel::kEllipse, .finish = {.antialias = false}};

/// Fills the empty pixels of a resolved tile, grown by `grow` pixels: bilinear between the backdrop's pixels of one
/// surface, where the four around a pixel are covered.
///   rect: where the tile lies in the picture; near_m: of its camera.
void fill_from(const Backdrop& backdrop, const geometry::Rect& rect, float near_m, const ResolvedTile& tile, int grow);

}  // namespace telesplat::splat
