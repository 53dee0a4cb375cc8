// What is done to every pixel of a panel, many at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace telesplat::stereo::detail {

/// Of a row of pixels: the line of the first, and how much of a line it is to the next. Lines are half of one too large
/// and above 0.5.
struct Lines {
  float first, step;
};

/// Whose subpixels are: 0xff in the bits of those that an eye gets; the eye that is nearer to a line, or none within
/// `guard`.
struct Sharing {
  std::array<Lines, 2> eyes;     ///< left, right: for the first part of the first pixel
  float guard = 0;               ///< share of a line
  int parts = 3;                 ///< of a pixel, side by side
  std::array<uint32_t, 3> bits;  ///< of each part
};
/// left, right: room for 16 pixels more than `pixels`.
void share_pixels(const Sharing& sharing, int pixels, uint32_t* left, uint32_t* right);

/// a where the weight is 0, b where it is 256; channel by channel. out: room for 16 more than `pixels`, as a and b.
void mix(const uint32_t* a, const uint32_t* b, uint32_t weight, size_t pixels, uint32_t* out);

/// The same of pairs a b a b ..., each with a weight of its own. pairs: room for 32 more, weights and out for 16.
void mix_pairs(const uint32_t* pairs, const uint32_t* weights, size_t pixels, uint32_t* out);

}  // namespace telesplat::stereo::detail
