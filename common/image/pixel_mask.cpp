#include "common/image/pixel_mask.h"

namespace telesplat::image {

size_t PixelMask::count() const {
  size_t n = 0;
  for (const uint64_t word : words_) n += set_bits(word);
  return n;
}

size_t PixelMask::runs() const {
  size_t n = 0;
  for (int y = 0; y < height_; ++y)
    for (size_t w = 0; w < words_per_row_; ++w) {
      const uint64_t word = row(y)[w], last = w == 0 ? 0 : row(y)[w - 1] >> 63;
      n += set_bits(word & ~(word << 1 | last));
    }
  return n;
}

}  // namespace telesplat::image
