// Blocks of a slice image, 64 x 64 pixels each, coded with the symbol coder of the depth codec (codec/dense/rans.h).
// All blocks of an image share its tables.
//
// Tables of an image: for each plane (alpha, green, blue, red) bias (13 bits) and shift (4 bits) of its contexts, then
// levels of its tokens (codec/dense/tables.h); little-endian, padded to a byte.
// Block: u64 mask: bit g means that group g is not empty; 8 u32, the coder's states; words of 16 bits. A group is 16 x
// 4 pixels; groups are in order of rows, four a row.
//
// Residuals are each channel minus (above + left - above left), modulo 256, with pixels outside the block as 0; then
// red and blue minus green, folded (0, -1, 1, -2 ...). Only groups in the mask are coded; elsewhere residuals are 0.
// Symbols come plane after plane, row after row. Context of a residual: clamp((sum - bias) >> shift, 0, 15), where sum
// weighs the tokens above (3), above on both sides (2), two rows above (1), and in the plane before here (4) and on
// both sides (2); outside the block tokens are 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/core/result.h"

namespace telesplat::volume {

inline constexpr int kBlockSide = 64;
inline constexpr size_t kBlockPixels = size_t{kBlockSide} * kBlockSide;

/// Codes all blocks of one image.
class BlockCoder {
 public:
  BlockCoder();
  ~BlockCoder();
  /// Forgets all blocks.
  void start();
  /// pixels: row after row.
  void add(const uint32_t* pixels);
  /// To be called after the last block: appends the tables, at most 65535 bytes.
  void put_tables(std::vector<uint8_t>& out);
  /// Appends block n, in the order of add(), at most 65535 bytes. To be called after put_tables().
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
  /// Error: the bytes are not valid tables.
  Status set_tables(std::span<const uint8_t> tables);
  /// Error: not exactly a block's bytes; pixels are undefined then. Precondition: set_tables() succeeded.
  Status decode(std::span<const uint8_t> bytes, uint32_t* pixels);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace telesplat::volume
