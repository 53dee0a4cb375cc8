// How good a reconstructed view is, against direct rendering of the data (docs/quality.md).
#pragma once

#include "common/image/file.h"

namespace telesplat::image {

struct Quality {
  double psnr_db = 0;        ///< over pixels where reference or reconstruction shows the data set; 99 where identical
  double ssim = 0;           ///< mean over the same pixels (Wang et al. 2004, 11x11 Gaussian, sigma 1.5, on luma)
  double hole_fraction = 0;  ///< object pixels where the reconstruction shows background or something > 1 % farther
  size_t object_pixels = 0;  ///< pixels where the reference shows the data set; nothing is defined if 0
};

/// Preconditions: equal sizes, both with depth.
Quality compare(const View& reference, const View& reconstruction);

}  // namespace telesplat::image
