// A display wall of viewers that each show a part of one frustum (T3.3.3): its layout, and its picture after the run.
#pragma once

#include <string>
#include <vector>

#include "client/viewer/display/wall.h"
#include "common/core/result.h"

namespace telesplat::launcher {

using viewer::WallLayout;

inline constexpr int kMaxViewers = 64;

/// A viewer's name, and the folder it records into: the first one's is the run's own, the others have one of theirs in
/// it.
std::string viewer_name(int number);
std::string viewer_directory(const std::string& run_directory, int number);

/// The newest picture of a tile.
struct TilePicture {
  std::string viewer;
  uint64_t frame = 0;
  double t_s = 0;  ///< on that viewer's clock, from frames.csv
};

/// Puts the newest recorded picture of each tile's viewer (1, 2, ...) into one, DIR/images/wall.png: a described wall
/// unrolled, black where its bezels are. Returns what it was made from. Error: a viewer recorded none, a picture has
/// another size than its tile, or the whole is larger than a picture may be.
Result<std::vector<TilePicture>> stitch_wall(const std::string& run_directory, const viewer::WallTile& wall);

/// Keeps the description of the wall in the record, wall.toml, if it has one. Error: it cannot be read or written any
/// more.
Status keep_description(const std::string& run_directory, const std::string& wall);
/// The same of an autostereo display's file, which people edit to calibrate it; empty: there is none.
Status keep_barrier(const std::string& run_directory, const std::string& barrier);

}  // namespace telesplat::launcher
