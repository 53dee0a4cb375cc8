// Blocks of a slice image as symbols of the depth codec's coder (codec/dense/rans.h), whose tables all blocks of an
// image share: about three fifths of the bytes of packed blocks (block.h), at some twenty times their time.
//
// Tables of an image: for each plane (alpha, green, blue, red) bias (13 bits) and shift (4 bits) of its contexts, then
// levels of its tokens (codec/dense/tables.h); little-endian, padded to a byte.
// Block: u8 kCoded; u64 mask, as in block.h; 32 u32, the coder's states; words of 16 bits.
//
// Residuals are those of block.h with predictor 2, less green, zigzagged; of the groups in the mask alone, elsewhere
// they are 0. Symbols come plane after plane, row after row, those of a row's groups together. Context of a residual:
// clamp((sum - bias) >> shift, 0, 15), where sum weighs the tokens above (3), above on both sides (2), two rows above
// (1), and of the plane before those here (4) and on both sides (2); outside the block tokens are 0.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::volume {

inline constexpr uint8_t kCoded = 4;  ///< where packed blocks have their predictor; 3 was that of 12-bit frequencies
inline constexpr size_t kMaxTableBytes = 0xffff;

/// Codes all blocks of one image.
class BlockCoder {
 public:
  BlockCoder();
  ~BlockCoder();
  /// Forgets all blocks.
  void start();
  /// pixels: 64 x 64.
  void add(const uint32_t* pixels);
  /// After the last block: appends the tables.
  void put_tables(std::vector<uint8_t>& out);
  /// Appends block n, in the order of add(); once the tables are put.
  void put(size_t n, std::vector<uint8_t>& out);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Decodes blocks that share tables. Bytes come from outside.
class BlockDecoder {
 public:
  BlockDecoder();
  ~BlockDecoder();
  /// Error: they are no tables.
  Status set_tables(std::span<const uint8_t> tables);
  /// bytes: with kCoded before them. Error: not exactly a block's bytes; pixels are undefined then.
  Status decode(std::span<const uint8_t> bytes, uint32_t* pixels);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace telesplat::volume
