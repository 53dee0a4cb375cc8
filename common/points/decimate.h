// Decimation (T4.3.2, T7.2): chooses the samples of a tile that represent their neighbourhood at coarser levels, and
// their colours.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/points/point_model.h"
#include "common/points/unproject.h"

namespace telesplat::points {

/// Points lie in a mosaic by rank, then in the order in which their 4x4 blocks are scanned. A rank is a place in the
/// 4x4 block: rank 0 holds points of all three levels (the pixel near the centre), 1 to 3 those of levels 0 and 1 (the
/// upper left pixels of the 2x2 blocks), 4 to 15 those of level 0 alone: first the lower right, then the right, then
/// the lower pixels of the 2x2 blocks. So coarse levels are prefixes, and any prefix in between is spread evenly too
/// (ordered dithering, Bayer 1973): half of the points are a quincunx. Consecutive points lie four pixels apart: a
/// splatter that draws neighbouring pixels one after the other waits for its own stores.
inline constexpr int kRanks = 16;
inline constexpr int kFirstRankOfLevel0 = 4;  ///< lower ranks also belong to level 1

/// The 2x2 blocks (0 upper left, 1 upper right, 2 lower left, 3 lower right) in the order in which ranks take them:
/// each is followed by the one diagonally across.
inline constexpr std::array<int, 4> kBlockOrder{3, 0, 1, 2};
/// The inverse: the position of each 2x2 block in that order.
inline constexpr std::array<int, 4> kBlockPlace{1, 2, 3, 0};
/// The pixels of a 2x2 block that only level 0 has (1 right, 2 lower, 3 lower right), in the order of their ranks.
inline constexpr std::array<int, 3> kPixelOrder{3, 1, 2};

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

/// keys: those of unproject_row, for every pixel of the tile.
DecimatedTile decimate(const geometry::Rect& tile, const image::DepthImage& image, const ClusterKey* keys);

}  // namespace telesplat::points
