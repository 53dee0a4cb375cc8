// Perceived difference of two pictures that alternate on a display: the LDR-FLIP error map.
// This work is based on: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. (HPG) 3(2), 2020. Written from the paper.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/image/file.h"

namespace telesplat::image {

/// The paper's viewing conditions: a 3840 pixel wide monitor of 0.7 m, seen from 0.7 m.
inline constexpr double kFlipPixelsPerDegree = 67.02;

/// Compares pictures with one reference; computes its part of the work once.
///
/// Per pixel, with colours as sRGB codes (file.h):
///   colour: linear RGB -> YyCxCz; each channel filtered with its contrast sensitivity function (sums of Gaussians
///     in degrees, sampled at pixels_per_degree, to 3 standard deviations of the widest); back to linear RGB, clamped
///     to [0, 1]; -> L*a*b* with Hunt's adjustment (a, b times L / 100);
///     h = |dL| + sqrt(da^2 + db^2) (HyAB), raised to 0.7 and compressed so that 0.4 of the largest (green against
///     blue) becomes 0.95: dE_c in [0, 1];
///   features: first (edges) and second (points) derivatives of a Gaussian of 0.082 degrees' width on luminance,
///     (Yy + 16) / 116;
///     dE_f = sqrt(max(|difference of edge magnitudes|, |difference of point magnitudes|) / sqrt 2), in [0, 1];
///   FLIP = dE_c ^ (1 - dE_f).
/// At borders the nearest pixel is repeated. The map does not depend on the number of threads.
class Flip {
 public:
  /// pixels_per_degree in [1, 1000]. Precondition: the view is not empty.
  explicit Flip(const View& reference, double pixels_per_degree = kFlipPixelsPerDegree);
  ~Flip();
  Flip(Flip&&) noexcept;

  /// Width x height values in 0..1, 0 for equal pixels. Precondition: `test` has the reference's size.
  std::vector<float> error_map(const View& test) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Colour of an error 0..1 in pictures of error maps, 0x00RRGGBB: black - purple - orange - light yellow, rising in
/// lightness (after the "magma" map of Matplotlib: nine of its colours, interpolated linearly). Values outside are
/// clamped.
uint32_t magma(float error);

/// The map as a picture.
View picture_of_errors(const std::vector<float>& map, int width, int height);

}  // namespace telesplat::image
