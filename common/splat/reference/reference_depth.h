// The reference depth map of a sampling view and redundancy elimination (T4.3.1).
#pragma once

#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"
#include "common/points/point_model.h"

namespace telesplat::splat {

/// Depth in metres of the nearest point in each pixel of `camera`, +infinity for empty pixels: of all level-0 points of
/// the model, one pixel each, without those that face away. The last bits of a depth hold the point's place in the
/// pixel (splat_kernels.h, kReferenceSubBits): relative error at most 2^-15. SIMD; `threads` oneTBB threads (0 = all).
void render_reference_depth(const points::PointModel& model, const geometry::Camera& camera, int threads,
                            std::vector<float>& depth_m);

/// Updates depth_m, of a model without the patch's points, as if the model had them.
void add_to_reference_depth(const points::PreparedPatch& patch, const points::ModelConfig& model,
                            const geometry::Camera& camera, std::vector<float>& depth_m);

struct Elimination {
  uint64_t samples = 0, kept = 0;
};

/// A sample is not needed if the model has a point of its surface within this many pixels, since that point's splat
/// reaches as far. This bounds a model's points, from any number of views. No two points are nearer to each other than
/// this times the sample distance of the finer one, unless a nearer point of the same pixel hid one of them. So a
/// surface has at most about 2 / sqrt 3 / kNearestSample^2 points a pixel.
inline constexpr float kNearestSample = 0.6f;

/// Clears every pixel of `image` (the tile `tile` of the frame `camera`) that the model already shows. It is kept if
///   it is nearer than the reference by more than epsilon (T4.3.1), epsilon = relative_epsilon * depth; and
///   no point of the eight pixels around it lies within `nearest` pixels of its centre and within epsilon of its
///   tangent plane.
/// Keeps canonical form. nearest 0: tests only the first condition.
Elimination eliminate_redundancy(const geometry::Camera& camera, const geometry::Rect& tile,
                                 const std::vector<float>& reference_depth_m, float relative_epsilon,
                                 image::DepthImage& image, float nearest = kNearestSample);

/// The model as seen where a tile was sampled, if it was rendered already.
struct KnownReference {
  const image::PixelMask& cast;      ///< as large as the tile; pixels outside it are not covered
  std::span<const float> nearest_m;  ///< frame-sized render_reference_depth(), without the frame's own samples
};

/// The same for a tile in which only the pixels of `known.cast` were sampled; all other pixels of the image are empty.
Elimination eliminate_where_cast(const geometry::Camera& camera, const geometry::Rect& tile,
                                 const KnownReference& known, float relative_epsilon, image::DepthImage& image,
                                 float nearest = kNearestSample);

}  // namespace telesplat::splat
