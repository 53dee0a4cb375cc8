#include "tools/telesplat/run/wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "common/geometry/camera.h"
#include "common/image/canvas.h"
#include "common/image/file.h"
#include "tools/telesplat/record/csv_line.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// The newest frame-NNNNNN.png of a folder.
std::optional<std::pair<uint64_t, std::string>> newest_picture(const std::string& directory) {
  std::optional<std::pair<uint64_t, std::string>> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    uint64_t number = 0;
    if (!name.starts_with("frame-") || !name.ends_with(".png")) continue;
    const auto read = std::from_chars(name.data() + 6, name.data() + name.size() - 4, number);
    if (read.ec == std::errc() && read.ptr == name.data() + name.size() - 4 && (!out || number > out->first))
      out = {number, entry.path().string()};
  }
  return out;
}

// When the frames of `tiles` were displayed.
void read_times(const std::string& path, std::vector<WallTile>& tiles) {
  std::ifstream in(path);
  std::string line;
  if (!std::getline(in, line)) return;
  const auto header = csv_fields(line).value_or(std::vector<std::string>{});
  const auto column = [&](const char* name) {
    return size_t(std::find(header.begin(), header.end(), name) - header.begin());
  };
  const size_t viewer = column("viewer"), frame = column("frame"), t = column("t_s");
  if (std::max({viewer, frame, t}) >= header.size()) return;
  while (std::getline(in, line)) {
    const auto fields = csv_fields(line);
    if (!fields || fields->size() != header.size()) continue;
    for (auto& tile : tiles)
      if ((*fields)[viewer] == tile.viewer && std::strtod((*fields)[frame].c_str(), nullptr) == double(tile.frame))
        tile.t_s = std::strtod((*fields)[t].c_str(), nullptr);
  }
}

}  // namespace

Result<WallLayout> parse_wall(const std::string& text) {
  WallLayout out;
  char rest = 0;
  if (text.size() > 16 || std::sscanf(text.c_str(), "%dx%d%c", &out.columns, &out.rows, &rest) != 2 ||
      out.columns < 1 || out.rows < 1 || out.columns > kMaxViewers || out.rows > kMaxViewers ||
      out.tiles() > kMaxViewers)
    return Error{fmt::format("--wall {}: is not COLUMNSxROWS with 1 to {} tiles", text.substr(0, 40), kMaxViewers)};
  return out;
}

std::string viewer_name(int number) { return fmt::format("viewer-{}", number); }

std::string viewer_directory(const std::string& run_directory, int number) {
  return number == 1 ? run_directory : run_directory + "/" + viewer_name(number);
}

Result<std::vector<WallTile>> stitch_wall(const std::string& directory, const WallLayout& layout) {
  std::vector<WallTile> tiles;
  std::optional<image::Canvas> wall;
  int width = 0, height = 0;
  for (int i = 0; i < layout.tiles(); ++i) {
    const std::string folder = viewer_directory(directory, i + 1) + "/images";
    const auto newest = newest_picture(folder);
    if (!newest) return Error{fmt::format("{}: holds no picture of the wall's tile {}", folder, i + 1)};
    const auto picture = image::read_view(newest->second);
    if (!picture) return picture.error();
    if (!wall) {
      width = picture->width, height = picture->height;
      const int across = width * layout.columns, down = height * layout.rows;
      if (std::max(across, down) > geometry::kMaxImageSide)
        return Error{fmt::format("{}/images: the wall has {}x{} pixels, limit {} a side", directory, across, down,
                                 geometry::kMaxImageSide)};
      wall.emplace(across, down, 0xff000000u);
    }
    if (picture->width != width || picture->height != height)
      return Error{fmt::format("{}: has {}x{} pixels, the wall's first tile {}x{}", newest->second, picture->width,
                               picture->height, width, height)};
    wall->place(*picture, i % layout.columns * width, i / layout.columns * height);
    tiles.push_back({viewer_name(i + 1), newest->first, 0});
  }
  read_times(directory + "/frames.csv", tiles);
  if (const Status s = image::write_png(directory + "/images/wall.png", wall->view()); !s) return s.error();
  return tiles;
}

}  // namespace telesplat::launcher
