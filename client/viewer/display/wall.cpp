#include "client/viewer/display/wall.h"

#include <fmt/format.h>

#include "client/viewer/display/size_text.h"

namespace telesplat::viewer {
namespace {

constexpr int kMaxSide = 16;

}  // namespace

Result<WallLayout> parse_wall(const std::string& text, int most_tiles) {
  const auto pair = parse_pair(text, 1, kMaxSide);
  if (!pair) return Error{fmt::format("--wall {}: not COLUMNSxROWS with both in 1..{}", text.substr(0, 40), kMaxSide)};
  const WallLayout out{pair->first, pair->second};
  if (out.tiles() > most_tiles)
    return Error{fmt::format("--wall {}: it has {} tiles; at most {}", text, out.tiles(), most_tiles)};
  return out;
}

geometry::Camera tile_of(const geometry::Camera& whole, const WallTile& wall) {
  if (wall.columns == 1 && wall.rows == 1) return whole;  // to the last bit
  const int width = whole.width / wall.columns, height = whole.height / wall.rows;
  return geometry::crop(whole, {wall.tile % wall.columns * width, wall.tile / wall.columns * height, width, height});
}

image::DisplayPart part_of_wall(int width, int height, const WallTile& wall) {
  return {width * wall.columns, height * wall.rows, wall.tile % wall.columns * width,
          wall.tile / wall.columns * height};
}

}  // namespace telesplat::viewer
