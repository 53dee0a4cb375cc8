// Quality of a reconstructed view, compared with direct rendering of the data (docs/quality.md).
#pragma once

#include "common/image/measures/flip.h"
#include "common/image/measures/reference.h"

namespace telesplat::image {

/// A pixel counts if any ray of the reference, or the reconstruction, shows the data set.
struct Quality {
  double psnr_db = 0;        ///< over pixels that count; 99 if identical
  double ssim = 0;           ///< mean over the same pixels (Wang et al. 2004, 11x11 Gaussian, sigma 1.5, on luma)
  double hole_fraction = 0;  ///< share of object pixels that show background or a depth > 1 % farther
  size_t object_pixels = 0;  ///< pixels whose rays all meet the data set; if 0, all figures are undefined
  size_t hole_pixels = 0;
  double covered_fraction = 0;  ///< share of all pixels that show the data set where no ray meets it
  double nearer_fraction = 0;   ///< share of all pixels that show something > 1 % nearer than each of their rays
};

/// An object pixel is one whose rays all meet the data; its depth is that of the farthest ray (reference.h): so a hole
/// shows a place that none of its rays sees. If a pixel's rays disagree, the display may show either.
/// Preconditions: equal sizes, both with depth.
Quality compare(const Reference& reference, const View& reconstruction);
/// The same with a reference of one ray a pixel.
Quality compare(const View& reference, const View& reconstruction);

/// True if pixel `at` counts.
bool counts(const Reference& reference, const View& reconstruction, size_t at);
/// True if pixel `at` is an object pixel of `reference` that `reconstruction` does not show.
bool is_hole(const View& reference, const View& reconstruction, size_t at);

/// Mean of an error map (flip.h) over the pixels that count; 0 without such pixels. Precondition: equal sizes.
double mean_error(const std::vector<float>& map, const Reference& reference, const View& reconstruction);
/// Mean FLIP over the pixels that count.
double flip(const Reference& reference, const View& reconstruction, double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace telesplat::image
