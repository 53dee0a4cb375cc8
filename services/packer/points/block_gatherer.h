// Puts the tiles of a block together: samplers may lease single rows; a block of rows is packed and published at once.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Frames whose blocks are being gathered. With one more, the oldest one's blocks are dropped.
inline constexpr size_t kMaxGatheredFrames = 64;
/// Pixels of a block that is gathered, at most: 64 rows of the widest image. Its first tile allocates them all.
inline constexpr size_t kMaxBlockPixels = size_t{1} << 20;
/// Pixels of all blocks together (ten bytes each). Beyond it the oldest frame's blocks are dropped.
inline constexpr size_t kMaxGatheredPixels = size_t{1} << 25;

class BlockGatherer {
 public:
  struct Gathered {
    uint64_t samples = 0;              ///< covered pixels that this tile brought and none before it had
    std::optional<SampledTile> block;  ///< the tile's block, if this tile completes it
    bool is_block = false;             ///< the tile is its block: the tile's stream is the block's too
  };
  struct Statistics {
    uint64_t tiles = 0;            ///< taken
    uint64_t tiles_duplicate = 0;  ///< dropped: all of their rows were there
    uint64_t tiles_refused = 0;    ///< dropped: contradict themselves, their block or their frame
    uint64_t blocks_dropped = 0;   ///< incomplete, to make room
  };

  /// Decodes a tile and puts its rows in their place; rows that are there already stay as they are.
  ///   block: the label of the tile's block; no image yet.
  ///   rect: the tile, in the frame: whole rows of the block.
  /// A tile that is its block passes through without a copy. Nothing: all of its rows are there (it is not even
  /// decoded). Error: camera, rectangles, block or stream do not fit together, or not with earlier tiles; nothing has
  /// changed then. Precondition: the block was not packed yet (PackerCore::has).
  Result<std::optional<Gathered>> add(SampledTile block, const geometry::Rect& rect, std::span<const uint8_t> stream);

  void clear();
  size_t open_blocks() const;
  const Statistics& statistics() const { return statistics_; }

 private:
  struct Block {
    SampledTile gathered;  // image: of the block's size; rows not there yet are not covered
    std::vector<bool> has_row;
    int rows_left = 0;
  };
  struct Frame {
    FrameId id;
    std::vector<Block> blocks;  // incomplete ones
  };
  Frame* find(FrameId id);
  void make_room(FrameId frame, size_t pixels);
  Result<std::optional<Gathered>> pass(SampledTile block, std::span<const uint8_t> stream);
  std::optional<Gathered> take(Frame& frame, Block& block, const geometry::Rect& rect);

  std::deque<Frame> frames_;  // oldest first
  size_t pixels_ = 0;         // of all blocks
  image::DepthImage tile_;    // kept for its memory
  Statistics statistics_;
};

}  // namespace telesplat::packer
