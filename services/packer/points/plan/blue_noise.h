// Sparse sets of pixels that are spread evenly, without regular patterns: blue noise.
// Source: Ulichney 1993, "The void-and-cluster method for dither array generation".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace telesplat::packer {

/// Cuts the pixels of a 64x64 square, which repeats over the image, into `share` sets of about equal size, each of them
/// spread evenly: round r picks set r % share, so that every pixel is picked once in `share` rounds.
class BlueNoise {
 public:
  static constexpr int kSide = 64, kMaxShare = 4096;

  /// share outside [1, kMaxShare] is brought into it.
  explicit BlueNoise(int share);

  int share() const { return share_; }
  bool picks(int x, int y, uint64_t round) const { return (row(y, round) >> (x & (kSide - 1)) & 1) != 0; }
  /// Of pixels x = 64 n to 64 n + 63 of row y, whatever n: as a word of an image::PixelMask.
  uint64_t row(int y, uint64_t round) const {
    return rows_[(round % static_cast<uint64_t>(share_)) * kSide + static_cast<unsigned>(y & (kSide - 1))];
  }

 private:
  int share_;
  std::vector<uint64_t> rows_;  // share x kSide
};

/// The dither array: each of 0..4095 once, at y * 64 + x. Computed at the first call.
const std::array<uint16_t, size_t{BlueNoise::kSide} * BlueNoise::kSide>& blue_noise_ranks();

}  // namespace telesplat::packer
