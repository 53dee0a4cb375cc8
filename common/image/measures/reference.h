// Direct rendering with several rays a pixel: the reference for displayed frames (docs/quality.md).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::image {

/// Most rays a pixel of a reference.
inline constexpr int kMostSamples = 64;

/// The data as seen with several rays a pixel.
///   view.colour   mean of the rays' colours, background included: a box filter on displayed colours
///   view.depth_m  the farthest depth at which a ray meets the data; +infinity unless all of them do
///   hits          number of rays in each pixel that met the data; empty for one ray a pixel, whose depth shows it
///   nearest_m     the nearest depth at which a ray meets the data; +infinity if no ray does; empty for one ray a pixel
struct Reference {
  int samples = 1;
  View view;
  std::vector<uint16_t> hits;
  std::vector<float> nearest_m;
};

/// Error: `samples` is not 1, 4, 9, 16, 25, 36, 49 or 64.
Status validate_samples(int samples);

/// Makes a reference with one ray a pixel from a picture. Precondition: view has depth.
Reference reference_of(View view);

/// A picture of `camera` with s x s rays a pixel, s^2 = samples, one through the middle of each of its s x s equal
/// parts. draw: makes the picture of a camera with one ray through each pixel's centre, with depth. It is called for
/// pieces of `camera`, each with s times the resolution and at most 2048 x 2048 pixels; for one ray a pixel it is
/// called for `camera` itself. Errors of draw are passed on. Precondition: samples validates.
Result<Reference> supersample(const geometry::Camera& camera, int samples,
                              const std::function<Result<View>(const geometry::Camera&)>& draw);

}  // namespace telesplat::image
