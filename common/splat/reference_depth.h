// The reference depth map of a sampling view and redundancy elimination (T4.3.1).
#pragma once

#include <vector>

#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/points/point_model.h"

namespace telesplat::splat {

/// Depth in metres of the nearest point in each pixel of `camera`, +infinity where none: all level-0 points of the model,
/// unsplatted (one pixel each), mosaics that face away left out. SIMD; `threads` oneTBB threads (0 = all).
void render_reference_depth(const points::PointModel& model, const geometry::Camera& camera, int threads,
                            std::vector<float>& depth_m);

struct Elimination {
  uint64_t samples = 0, kept = 0;
};

/// Clears every pixel of `image` (the tile `tile` of the frame `camera`) that the model already shows: a pixel is kept only if
/// it is nearer than the reference by more than epsilon (T4.3.1), epsilon = relative_epsilon * depth. Keeps canonical form.
Elimination eliminate_redundancy(const geometry::Camera& camera, const geometry::Rect& tile,
                                 const std::vector<float>& reference_depth_m, float relative_epsilon,
                                 image::DepthImage& image);

}  // namespace telesplat::splat
