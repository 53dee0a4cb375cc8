// A wall of displays that each show a part of one frustum (T3.3.3). Tiles are counted by rows, from the upper left.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/legend.h"

namespace telesplat::viewer {

struct WallLayout {
  int columns = 1, rows = 1;
  int tiles() const { return columns * rows; }
  bool operator==(const WallLayout&) const = default;
};

/// "2x1": columns x rows, 1 to 16 of each. Error: not of that form, or more than `most_tiles` tiles.
Result<WallLayout> parse_wall(const std::string& text, int most_tiles = 16 * 16);

/// Which part of a wall a display is.
struct WallTile {
  int columns = 1, rows = 1, tile = 0;
};

/// The camera of this display, one of a wall's tiles: its part of the off-axis frustum of the whole.
geometry::Camera tile_of(const geometry::Camera& whole, const WallTile& wall);

/// The same in pixels, of a display of width x height.
image::DisplayPart part_of_wall(int width, int height, const WallTile& wall);

}  // namespace telesplat::viewer
