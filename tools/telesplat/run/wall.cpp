#include "tools/telesplat/run/wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

#include "common/geometry/camera.h"
#include "common/image/canvas.h"
#include "common/image/file.h"
#include "tools/common/csv_table.h"

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

// When the frames of `tiles` were displayed; 0 where that is not recorded.
void read_times(const std::string& path, std::vector<TilePicture>& tiles) {
  const auto table = tools::CsvTable::read(path, {});
  if (!table) return;
  const auto viewer = table->find("viewer"), frame = table->find("frame"), t = table->find("t_s");
  if (!viewer || !frame || !t) return;
  for (size_t row = 0; row < table->rows(); ++row)
    for (auto& tile : tiles)
      if (table->text(row, *viewer) == tile.viewer && table->text(row, *frame) == std::to_string(tile.frame))
        if (const auto t_s = table->number(row, *t)) tile.t_s = *t_s;
}

}  // namespace

std::string viewer_name(int number) { return fmt::format("viewer-{}", number); }

std::string viewer_directory(const std::string& run_directory, int number) {
  return number == 1 ? run_directory : run_directory + "/" + viewer_name(number);
}

Result<std::vector<TilePicture>> stitch_wall(const std::string& directory, const WallLayout& layout) {
  std::vector<TilePicture> tiles;
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
