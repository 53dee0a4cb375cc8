// Prediction of rows of pixels from the row above and the pixel to the left, and its inverse.
//   depth:            L + U - UL (mod 2^24). Reciprocal depth is linear in screen space, so that a plane leaves only
//   rounding. colour, normals:  the median of L, U and L + U - UL, byte by byte (M. Weinberger, G. Seroussi, G. Sapiro,
//   "The LOCO-I
//                     lossless image compression algorithm", IEEE Transactions on Image Processing 9(8), 2000, eq. 1).
// L, U, UL: neighbours to the left, above, above left. Pixels without coverage hold their own prediction ("filled").
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// One row of filled pixels, and one more to its left, at index -1.
class FilledRow {
 public:
  void reset(size_t width) {
    depth_.resize(width + kPad);
    colour_.resize(width + kPad);
    normal_.resize(width + kPad);
  }
  uint32_t* depth() { return depth_.data() + kLead; }
  uint32_t* colour() { return colour_.data() + kLead; }
  uint16_t* normal() { return normal_.data() + kLead; }
  const uint32_t* depth() const { return depth_.data() + kLead; }
  const uint32_t* colour() const { return colour_.data() + kLead; }
  const uint16_t* normal() const { return normal_.data() + kLead; }

 private:
  static constexpr size_t kLead = 1, kPad = kLead + 63;  // kernels may read and write to the end of a vector
  std::vector<uint32_t> depth_, colour_;
  std::vector<uint16_t> normal_;
};

/// Zigzag-folded residuals of a row, as tokens.h takes them: depth below 2^24; colour and normal byte by byte.
struct Residuals {
  void reset(size_t width) {
    depth.resize(width + kPad);
    colour.resize(width + kPad);
    normal.resize(width + kPad);
  }
  static constexpr size_t kPad = 64;
  std::vector<uint32_t> depth, colour;
  std::vector<uint16_t> normal;
};

/// residuals[x] = zigzag(row[x] - prediction) for x in [0, width), the row and the one above being filled.
void predict_row(FilledRow& above, FilledRow& row, size_t width, Residuals& residuals);

/// What decoding works on: colour and normal joined, colour in bytes 0-3 and normal in bytes 4-5, so that the median
/// predictor, whose pixels wait for each other, takes all of them in one step. Pixels or residuals.
struct JoinedRow {
  void reset(size_t width) {
    depth.resize(width + kPad);
    attributes.resize(width + kPad);
  }
  static constexpr size_t kPad = 64;  // kernels may read and write to the end of a vector
  std::vector<uint32_t> depth;
  std::vector<uint64_t> attributes;
};
inline uint64_t join(uint32_t colour, uint16_t normal) { return colour | uint64_t{normal} << 32; }
inline uint32_t colour_of(uint64_t joined) { return static_cast<uint32_t>(joined); }
inline uint16_t normal_of(uint64_t joined) { return static_cast<uint16_t>(joined >> 32); }

/// The inverse of predict_row: row[x] from residuals[x] and the row above, for x in [0, width). Neither writes past the
/// end. The first returns false if a depth is zero.
[[nodiscard]] bool reconstruct_depth(const uint32_t* above, const uint32_t* residuals, size_t width, uint32_t* row);
void reconstruct_attributes(const uint64_t* above, const uint64_t* residuals, size_t width, uint64_t* row);
/// Joined pixels -> planes.
void split_attributes(const uint64_t* row, size_t width, uint32_t* colour, uint16_t* normal);

/// Scalar forms of the two parts of predict_row that have vector kernels: what tests compare those with.
uint32_t predict_depth(uint32_t left, uint32_t up, uint32_t up_left);
uint32_t predict_bytes(uint32_t left, uint32_t up, uint32_t up_left);

/// Zigzag folding mod 2^24, and of every byte of a word mod 2^8.
inline uint32_t fold_depth(uint32_t difference) {
  const uint32_t v = difference << 8;  // sign to the top
  return ((v << 1) ^ (0 - (v >> 31))) >> 8 & image::kMaxDepthCode;
}
inline uint32_t unfold_depth(uint32_t z) { return (z >> 1) ^ (0 - (z & 1)); }  // mod 2^24
inline uint32_t fold_bytes(uint32_t value, uint32_t prediction) {
  constexpr uint32_t kHigh = 0x80808080u;
  const uint32_t v = ((value | kHigh) - (prediction & ~kHigh)) ^ ((value ^ ~prediction) & kHigh);
  return (v & ~kHigh) << 1 ^ (v >> 7 & 0x01010101u) * 255;
}
inline uint64_t unfold_bytes(uint64_t z) {
  return (z >> 1 & 0x7F7F7F7F7F7F7F7Full) ^ ((z & 0x0101010101010101ull) * 255);
}
/// Sum byte by byte mod 2^8 of a prediction and a folded residual.
inline uint32_t add_bytes(uint32_t prediction, uint32_t z) {
  constexpr uint32_t kHigh = 0x80808080u;
  const uint32_t v = static_cast<uint32_t>(unfold_bytes(z));
  return ((prediction & ~kHigh) + (v & ~kHigh)) ^ ((prediction ^ v) & kHigh);
}

}  // namespace telesplat::codec::detail
