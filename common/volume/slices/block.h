// One block of a slice image: 64 x 64 pixels <-> bytes. Made for speed first: fixed shapes, no entropy coder,
// everything in 128-bit vectors.
//
// Layout, little-endian: u8 predictor; u64 mask: bit g says that group g has anything in it; for each such group u16,
// four bits a plane, its width w in bits, 0 to 8; then for each such group, plane after plane, 8 w bytes. A group is 16
// x 4 pixels, groups lie in order of rows, four a row. What is coded are residuals, modulo 256 in every channel: each
// channel minus its predictor (0: the pixel above; 1: that on the left; 2: above + left - above left; pixels outside
// the block are 0), then red and blue (planes 2 and 0) minus green (plane 1), zigzag (0, -1, 1, -2 ...). Plane 3 is
// alpha. The 64 bytes of a plane, four rows r0 to r3 of 16, are split into bits 0..3, bits of weight 4, 2 and 1 in turn
// as w has them:
//   four bits: r0 | r2 << 4, r1 | r3 << 4
//   two bits:  r0 | r1 << 2 | r2 << 4 | r3 << 6
//   one bit:   t = r0 | r1 << 1 | r2 << 2 | r3 << 3: first half of t | second half << 4
// With w = 8 they stand as they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::volume {

inline constexpr int kBlockSide = 64;
inline constexpr size_t kBlockPixels = size_t{kBlockSide} * kBlockSide;
inline constexpr size_t kMaxBlockBytes = 1 + 8 + 64 * 2 + 4 * kBlockPixels;

/// pixels: row after row. out: room for kMaxBlockBytes; returns how many were written.
size_t encode_block(const uint32_t* pixels, uint8_t* out);
/// The other way; bytes come from outside. Error: not exactly a block's bytes; pixels are undefined then.
Status decode_block(std::span<const uint8_t> bytes, uint32_t* pixels);

}  // namespace telesplat::volume
