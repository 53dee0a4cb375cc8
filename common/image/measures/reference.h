// Direct rendering with several rays a pixel: what displayed frames are measured against (docs/quality.md).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::image {

/// The most rays a pixel of a reference.
inline constexpr int kMostSamples = 64;

/// The data as they would be seen with several rays a pixel.
///   view.colour   mean of what the rays show, background included: a box filter on displayed colours
///   view.depth_m  the farthest at which a ray meets the data; +infinity where not all of them do
///   hits          how many rays of each pixel met the data; empty of one ray a pixel, whose depth tells
struct Reference {
  int samples = 1;
  View view;
  std::vector<uint16_t> hits;
};

/// Error: `samples` is not 1, 4, 9, 16, 25, 36, 49 or 64.
Status validate_samples(int samples);

/// One ray a pixel, drawn already. Precondition: view has depth.
Reference reference_of(View view);

/// A picture of `camera` of s x s rays a pixel, s^2 = samples, one through the middle of each of its s x s equal parts.
/// draw: makes the picture of a camera with one ray through each pixel's centre, with depth. It is asked for pieces of
/// `camera`, each of s times the resolution and of at most 2048 x 2048 pixels; of one ray a pixel it is asked for
/// `camera` itself. Errors of draw are handed on. Precondition: samples validates.
Result<Reference> supersample(const geometry::Camera& camera, int samples,
                              const std::function<Result<View>(const geometry::Camera&)>& draw);

}  // namespace telesplat::image
