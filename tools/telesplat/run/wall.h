// A display wall of viewers that each show a part of one frustum (T3.3.3): its layout, and its picture after the run.
#pragma once

#include <string>
#include <vector>

#include "client/viewer/display/wall.h"
#include "common/core/result.h"

namespace telesplat::launcher {

using viewer::WallLayout;

inline constexpr int kMaxViewers = 64;

/// Returns a viewer's name, and the folder that it records into: the run's own for the first, a subfolder of it for the
/// others.
std::string viewer_name(int number);
std::string viewer_directory(const std::string& run_directory, int number);

/// The newest picture of a tile.
struct TilePicture {
  std::string viewer;
  uint64_t frame = 0;
  double t_s = 0;  ///< on that viewer's clock, from frames.csv
};

/// Puts the newest recorded picture of each tile's viewer (1, 2, ...) into one, DIR/images/wall.png: a described wall
/// unrolled, black where its bezels are. Returns the pictures used. Error: a viewer recorded no picture, a picture has
/// another size than its tile, or the whole is larger than a picture may be.
Result<std::vector<TilePicture>> stitch_wall(const std::string& run_directory, const viewer::WallTile& wall);

/// Copies the wall's description, if it has one, to wall.toml in the record. Error: the file cannot be read or written.
Status keep_description(const std::string& run_directory, const std::string& wall);
/// Copies an autostereo display's file, which people edit to calibrate it; barrier is empty without one.
Status keep_barrier(const std::string& run_directory, const std::string& barrier);

}  // namespace telesplat::launcher
