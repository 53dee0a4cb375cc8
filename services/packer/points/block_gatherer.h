// Gathers the tiles of a block: samplers may lease single rows; a block of rows is packed and published at once.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Number of frames whose blocks are gathered. With one more, the oldest frame's blocks are dropped.
inline constexpr size_t kMaxGatheredFrames = 64;
/// Pixels of one gathered block, at most: 64 rows of the widest image. The block's first tile allocates them all.
inline constexpr size_t kMaxBlockPixels = size_t{1} << 20;
/// Pixels of all gathered blocks together (ten bytes each). Beyond it the oldest frame's blocks are dropped.
inline constexpr size_t kMaxGatheredPixels = size_t{1} << 25;

class BlockGatherer {
 public:
  struct Gathered {
    uint64_t samples = 0;              ///< covered pixels that this tile brought first
    std::optional<SampledTile> block;  ///< the tile's block, if this tile completes it
    bool is_block = false;             ///< the tile covers its whole block: the tile's stream is the block's too
  };
  struct Statistics {
    uint64_t tiles = 0;            ///< taken
    uint64_t tiles_duplicate = 0;  ///< dropped: all of their rows had come already
    uint64_t tiles_refused = 0;    ///< dropped: they contradict themselves, their block or their frame
    uint64_t blocks_dropped = 0;   ///< incomplete blocks dropped to make room
  };

  /// Decodes a tile and copies its rows into the block; rows that came before stay as they are.
  ///       block: the label of the tile's block; its image is empty.
  ///   rect: the tile, in the frame: whole rows of the block.
  /// A tile that covers its block passes through without a copy. nullopt: all of its rows had come (it is not even
  /// decoded). Error: camera, rectangles, block or stream do not fit together, or not with earlier tiles; nothing has
  /// changed then. Precondition: the block was not packed yet (PackerCore::has).
  Result<std::optional<Gathered>> add(SampledTile block, const geometry::Rect& rect, std::span<const uint8_t> stream);

  void clear();
  size_t open_blocks() const;
  const Statistics& statistics() const { return statistics_; }

 private:
  struct Block {
    SampledTile gathered;  // image of the block's size; pixels of rows that have not come are not covered
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
  size_t pixels_ = 0;         // in all blocks together
  image::DepthImage tile_;    // kept for its memory
  Statistics statistics_;
};

}  // namespace telesplat::packer
