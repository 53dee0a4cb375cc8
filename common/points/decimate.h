// Decimation (T4.3.2, T7.2): which samples of a tile stand for their neighbourhood at the coarser levels, in which
// colour.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/points/point_model.h"
#include "common/points/unproject.h"

namespace telesplat::points {

/// Points lie in a mosaic by rank, then in the order in which their 4x4 blocks are scanned. Rank 0: points of all three
/// levels; 1: of levels 0 and 1; 2, 3, 4: of level 0 alone, the right, lower, and lower right pixels of their 2x2
/// blocks. Coarse levels are then prefixes, and consecutive points lie two or four pixels apart: a splatter that draws
/// neighbouring pixels one after the other waits for its own stores.
inline constexpr int kRanks = 5;

/// One sample, or a whole 4x4 block of one leaf and of nearly one depth (the common case).
struct SampleEntry {
  uint32_t pixel;  ///< index in the tile
  uint32_t leaf;   ///< index in DecimatedTile::leaves
  uint32_t rank;
  uint32_t mean[2];  ///< colours at levels 1 (ranks 0, 1) and 2 (rank 0)
};
struct BlockEntry {
  uint32_t pixel;  ///< index of its upper left pixel
  uint32_t leaf;
  uint32_t mean[5];  ///< level 1: upper left, upper right, lower left, lower right (the one near the centre); level 2
};

struct DecimatedTile {
  struct Leaf {
    ClusterKey key;
    std::array<uint32_t, kRanks> count{};  ///< samples of each rank, those of blocks among them
  };
  std::vector<Leaf> leaves;          ///< in order of appearance
  std::vector<BlockEntry> blocks;    ///< in scan order
  std::vector<SampleEntry> samples;  ///< in scan order of 4x4 blocks, 2x2 blocks, pixels; those outside `blocks`
};

/// keys: what unproject_row gave for every pixel of the tile.
DecimatedTile decimate(const geometry::Rect& tile, const image::DepthImage& image, const ClusterKey* keys);

}  // namespace telesplat::points
