// A wall of displays that show what one head sees (T3.3.3, T7.4): tiles of one picture, counted by rows from the upper
// left, or the screens of a description (client/wall).
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/wall/screen_camera.h"
#include "client/wall/wall.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/legend.h"

namespace telesplat::viewer {

struct WallLayout {
  int columns = 1, rows = 1;
  int tiles() const { return columns * rows; }
  bool operator==(const WallLayout&) const = default;
};

/// "2x1": columns x rows, 1 to 16 of each. Error: another form, or more than `most_tiles` tiles.
Result<WallLayout> parse_wall(const std::string& text, int most_tiles = 16 * 16);

/// True if --wall names a description: FILE.toml.
bool is_description(const std::string& wall);

/// A display's part of a wall.
struct WallTile {
  int columns = 1, rows = 1, tile = 0;
  std::shared_ptr<const wall::Wall> described;  ///< null: tiles of one picture; else `tile` is the number of a screen
  int tiles() const { return described ? int(described->screens.size()) : columns * rows; }
};

/// Reads --wall, --wall-tile and --wall-scale. An empty text is a wall of one tile. Error: names flag, value and limit,
/// or file, line and key.
Result<WallTile> wall_tile(const std::string& wall, int tile, double scale);

/// Returns the camera of this display, a tile of the wall: its part of the off-axis frustum of the whole.
geometry::Camera tile_of(const geometry::Camera& whole, const WallTile& wall);

/// Returns that part in pixels, for a display of width x height. A described wall is unrolled.
image::DisplayPart part_of_wall(int width, int height, const WallTile& wall);

struct DisplayOptions;
/// Returns the camera of a display with these options for a head.
geometry::Camera display_camera(const DisplayOptions& options, const geometry::Pose& head);
/// Returns a camera for the whole wall, for data to be fitted into.
geometry::Camera fitting_camera(const DisplayOptions& options);

/// Returns advice for the person if a wall that stands in the room does not show all of the data to the head. Looks at
/// its first screen. Nothing: the wall shows all, or the data are fitted into the display anyway.
std::optional<std::string> cut_off_by_wall(const DisplayOptions& options, const geometry::Pose& head,
                                           const geometry::Box& box_room);

}  // namespace telesplat::viewer
