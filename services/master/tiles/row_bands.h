// How the rows of a frame are handed out (T7.3): blocks from the middle outward, and bands of whole rows carved from
// them as samplers ask.
#pragma once

#include <vector>

#include "common/geometry/camera.h"

namespace telesplat::master {

inline constexpr int kBlockRows = 64;  ///< rows of a block; what is packed and published at once

/// Blocks of kBlockRows rows, as wide as the frame, the last of the image may be lower; those nearest the middle row
/// first (that is where the person looks, and where rows take longest, so that the frame ends with cheap ones).
std::vector<geometry::Rect> cut_blocks(int width, int height);

/// Carves bands from the blocks, one block after the other, each from its top.
class RowBands {
 public:
  RowBands() = default;  ///< of a frame that is not handed out by rows: nothing to carve
  explicit RowBands(const std::vector<geometry::Rect>& blocks);

  struct Band {
    size_t block = 0;
    geometry::Rect rect;
  };
  int rows_left() const { return rows_left_; }
  /// The next band: `rows` rows, or what the block has left. Precondition: rows >= 1, rows_left() > 0.
  Band carve(int rows);

 private:
  std::vector<geometry::Rect> blocks_;
  size_t block_ = 0;
  int begun_rows_ = 0;  // of block_
  int rows_left_ = 0;
};

/// Guided self-scheduling (Polychronopoulos and Kuck, 1987) with a target: as many rows as take target_s, but no more
/// than a third of an equal share of what is left (rounded up), so that all finish together. At least 1. row_s: seconds
/// a row of this sampler; 0: not known yet, 1 row.
int band_rows(double target_s, double row_s, int rows_left, size_t samplers);

}  // namespace telesplat::master
