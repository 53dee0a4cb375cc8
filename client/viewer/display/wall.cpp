#include "client/viewer/display/wall.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/size_text.h"
#include "client/wall/screen_camera.h"

namespace telesplat::viewer {
namespace {

constexpr int kMaxSide = 16;

}  // namespace

Result<WallLayout> parse_wall(const std::string& text, int most_tiles) {
  const auto pair = parse_pair(text, 1, kMaxSide);
  if (!pair)
    return Error{fmt::format("--wall {}: neither a file NAME.toml nor COLUMNSxROWS with both in 1..{}",
                             text.substr(0, 40), kMaxSide)};
  const WallLayout out{pair->first, pair->second};
  if (out.tiles() > most_tiles)
    return Error{fmt::format("--wall {}: it has {} tiles; at most {}", text, out.tiles(), most_tiles)};
  return out;
}

bool is_description(const std::string& wall) { return wall.ends_with(".toml"); }

Result<WallTile> wall_tile(const std::string& text, int tile, double scale) {
  WallTile out;
  out.tile = tile;
  if (is_description(text)) {
    auto read = wall::read_wall(text);
    if (!read) return Error{"--wall " + read.error().text};
    out.described = std::make_shared<const wall::Wall>(wall::scaled(std::move(*read), scale));
  } else if (!text.empty()) {
    const auto layout = parse_wall(text);
    if (!layout) return layout.error();
    out.columns = layout->columns, out.rows = layout->rows;
  }
  if (tile < 0 || tile >= out.tiles())
    return Error{fmt::format("--wall-tile {}: --wall {} has the {} 0..{}", tile, text.empty() ? "1x1" : text,
                             out.described ? "screens" : "tiles", out.tiles() - 1)};
  return out;
}

geometry::Camera tile_of(const geometry::Camera& whole, const WallTile& wall) {
  if (wall.columns == 1 && wall.rows == 1) return whole;  // exact to the last bit
  const int width = whole.width / wall.columns, height = whole.height / wall.rows;
  return geometry::crop(whole, {wall.tile % wall.columns * width, wall.tile / wall.columns * height, width, height});
}

image::DisplayPart part_of_wall(int width, int height, const WallTile& wall) {
  if (wall.described)
    if (const auto flat = wall::unrolled(*wall.described)) {
      const auto& place = flat->places[size_t(wall.tile)];
      return {flat->width, flat->height, place.x, place.y};
    }
  return {width * wall.columns, height * wall.rows, wall.tile % wall.columns * width,
          wall.tile / wall.columns * height};
}

geometry::Camera display_camera(const DisplayOptions& o, const geometry::Pose& head) {
  const stereo::Size eye = o.stereo.eye_size(o.width, o.height);
  if (o.wall.described) {
    geometry::Camera camera = wall::screen_camera(*o.wall.described, o.wall.tile, head, o.near_m);
    camera.width = eye.width, camera.height = eye.height;
    return camera;
  }
  return tile_of(geometry::make_camera(head, o.fov_deg, eye.width * o.wall.columns, eye.height * o.wall.rows, o.near_m),
                 o.wall);
}

geometry::Camera fitting_camera(const DisplayOptions& o) {
  if (o.wall.described) return wall::fitting_frustum(*o.wall.described, o.near_m);
  const stereo::Size eye = o.stereo.eye_size(o.width, o.height);
  return geometry::make_camera({}, o.fov_deg, eye.width * o.wall.columns, eye.height * o.wall.rows, o.near_m);
}

std::optional<std::string> cut_off_by_wall(const DisplayOptions& o, const geometry::Pose& head,
                                           const geometry::Box& box) {
  const auto& wall = o.wall.described;
  if (!wall || wall->anchor != wall::Anchor::kRoom || o.wall.tile != 0) return std::nullopt;
  const double share = wall::shown_share(*wall, head, box);
  if (share >= 1 || share <= 0) return std::nullopt;
  const glm::dvec3 size = glm::dvec3(box.hi) - glm::dvec3(box.lo);
  return fmt::format(
      "the screens of {} do not show all of the data to a head where it begins; with --room-size {:.3g} "
      "they do",
      wall->name, 0.99 * share * std::max({size.x, size.y, size.z}));
}

}  // namespace telesplat::viewer
