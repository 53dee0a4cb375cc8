// How good a reconstructed view is, against direct rendering of the data (docs/quality.md).
#pragma once

#include "common/image/measures/flip.h"
#include "common/image/measures/reference.h"

namespace telesplat::image {

/// Pixels count where any ray of the reference, or the reconstruction, shows the data set.
struct Quality {
  double psnr_db = 0;        ///< over pixels that count; 99 where identical
  double ssim = 0;           ///< mean over the same pixels (Wang et al. 2004, 11x11 Gaussian, sigma 1.5, on luma)
  double hole_fraction = 0;  ///< object pixels where the reconstruction shows background or something > 1 % farther
  size_t object_pixels = 0;  ///< pixels whose rays all meet the data set; nothing is defined if 0
  size_t hole_pixels = 0;
};

/// An object pixel is one whose rays all meet the data, and its depth is that of the farthest of them (reference.h): so
/// a hole shows what none of its rays sees. Where a pixel's rays disagree the display may show either.
/// Preconditions: equal sizes, both with depth.
Quality compare(const Reference& reference, const View& reconstruction);
/// The same against one ray a pixel.
Quality compare(const View& reference, const View& reconstruction);

/// Whether pixel `at` counts.
bool counts(const Reference& reference, const View& reconstruction, size_t at);
/// Whether pixel `at` is an object pixel of `reference` that `reconstruction` does not show.
bool is_hole(const View& reference, const View& reconstruction, size_t at);

/// Mean of an error map (flip.h) over the pixels that count; 0 if there are none. Precondition: equal sizes.
double mean_error(const std::vector<float>& map, const Reference& reference, const View& reconstruction);
/// Mean FLIP over the pixels that count.
double flip(const Reference& reference, const View& reconstruction, double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace telesplat::image
