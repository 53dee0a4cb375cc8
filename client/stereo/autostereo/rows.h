// Kernels for the rows of a panel, many pixels at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace telesplat::stereo::detail {

/// Lines along a row: that of the first pixel, and the step to the next one. They are half a line too large, and above
/// 0.5.
struct Lines {
  float first, step;
};

/// Sharing of a row's subpixels between the eyes: a subpixel goes to the eye that is nearer to a line. It stays black
/// if both distances differ by less than `guard`.
struct Sharing {
  std::array<Lines, 2> eyes;     ///< left, right; `first` is that of the first pixel's first part
  float guard = 0;               ///< share of a line
  int parts = 3;                 ///< parts of a pixel, side by side
  std::array<uint32_t, 3> bits;  ///< colour bits of each part
};
/// Writes 0xff into the bits that an eye gets. left, right: room for 16 pixels more than `pixels`.
void share_pixels(const Sharing& sharing, int pixels, uint32_t* left, uint32_t* right);

/// Mixes rows channel by channel: a for weight 0, b for 256. out: room for 16 more than `pixels`, as a and b.
void mix(const uint32_t* a, const uint32_t* b, uint32_t weight, size_t pixels, uint32_t* out);

/// Does the same for pairs a b a b ..., each with its own weight. pairs: room for 32 more, weights and out for 16.
void mix_pairs(const uint32_t* pairs, const uint32_t* weights, size_t pixels, uint32_t* out);

}  // namespace telesplat::stereo::detail
