// A display wall of viewers that each show a part of one frustum (T3.3.3): its layout, and its picture after the run.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Tiles are counted by rows, from the upper left.
struct WallLayout {
  int columns = 1, rows = 1;
  int tiles() const { return columns * rows; }
};

inline constexpr int kMaxViewers = 16;

/// "2x1": columns x rows. Error: not of that form, or not 1 to kMaxViewers tiles.
Result<WallLayout> parse_wall(const std::string& text);

/// A viewer's name, and the folder it records into: the first one's is the run's own, the others have one of theirs in it.
std::string viewer_name(int number);
std::string viewer_directory(const std::string& run_directory, int number);

/// The newest picture of a tile.
struct WallTile {
  std::string viewer;
  uint64_t frame = 0;
  double t_s = 0;  ///< on that viewer's clock, from frames.csv
};

/// Puts the newest recorded picture of each tile's viewer (1, 2, ...) into one, DIR/images/wall.png. Returns what it was made from.
/// Error: a viewer recorded none, they differ in size, or the whole is larger than a picture may be.
Result<std::vector<WallTile>> stitch_wall(const std::string& run_directory, const WallLayout& layout);

}  // namespace telesplat::launcher
