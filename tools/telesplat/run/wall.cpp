#include "tools/telesplat/run/wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

#include "client/wall/screen_camera.h"
#include "common/geometry/camera.h"
#include "common/image/canvas.h"
#include "common/image/file.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// Returns the newest frame-NNNNNN.png of a folder.
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

// Reads when the frames of `tiles` were displayed; 0 if the record does not say.
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

// Places of the tiles' pictures in the wall's.
using Flat = wall::Unrolled;

Result<Flat> lay_flat(const std::string& directory, const viewer::WallTile& wall, const image::View& first) {
  if (wall.described) {
    auto flat = wall::unrolled(*wall.described);
    if (!flat) return Error{fmt::format("{}/images: {}", directory, flat.error().text)};
    return flat;
  }
  Flat out;
  out.width = first.width * wall.columns, out.height = first.height * wall.rows;
  if (std::max(out.width, out.height) > geometry::kMaxImageSide)
    return Error{fmt::format("{}/images: the wall has {}x{} pixels, limit {} a side", directory, out.width, out.height,
                             geometry::kMaxImageSide)};
  for (int i = 0; i < wall.tiles(); ++i)
    out.places.push_back({i % wall.columns * first.width, i / wall.columns * first.height, first.width, first.height});
  return out;
}

// Enlarges pictures of screens with coarser pixels than the finest one: the nearest pixel.
image::View resized(const image::View& picture, int width, int height) {
  image::View out{width, height, std::vector<uint32_t>(size_t(width) * size_t(height)), {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      out.colour[size_t(y) * size_t(width) + size_t(x)] =
          picture.colour[size_t(int64_t{y} * picture.height / height) * size_t(picture.width) +
                         size_t(int64_t{x} * picture.width / width)];
  return out;
}

Status keep_copy(const std::string& file, const std::string& kept) {
  std::error_code error;
  fs::copy_file(file, kept, fs::copy_options::overwrite_existing, error);
  return error ? Status(Error{fmt::format("{}: {}", kept, error.message())}) : ok_status();
}

}  // namespace

std::string viewer_name(int number) { return fmt::format("viewer-{}", number); }

std::string viewer_directory(const std::string& run_directory, int number) {
  return number == 1 ? run_directory : run_directory + "/" + viewer_name(number);
}

Result<std::vector<TilePicture>> stitch_wall(const std::string& directory, const viewer::WallTile& wall) {
  std::vector<TilePicture> tiles;
  std::optional<image::Canvas> canvas;
  std::optional<Flat> flat;
  for (int i = 0; i < wall.tiles(); ++i) {
    const std::string folder = viewer_directory(directory, i + 1) + "/images";
    const auto newest = newest_picture(folder);
    if (!newest) return Error{fmt::format("{}: holds no picture of the wall's tile {}", folder, i + 1)};
    const auto picture = image::read_view(newest->second);
    if (!picture) return picture.error();
    if (!flat) {
      auto laid = lay_flat(directory, wall, *picture);
      if (!laid) return laid.error();
      flat = std::move(*laid);
      canvas.emplace(flat->width, flat->height, 0xff000000u);
    }
    const geometry::Rect& place = flat->places[size_t(i)];
    if (picture->width != place.width || picture->height != place.height) {
      if (!wall.described)
        return Error{fmt::format("{}: has {}x{} pixels, the wall's first tile {}x{}", newest->second, picture->width,
                                 picture->height, place.width, place.height)};
      canvas->place(resized(*picture, place.width, place.height), place.x, place.y);
    } else {
      canvas->place(*picture, place.x, place.y);
    }
    tiles.push_back({viewer_name(i + 1), newest->first, 0});
  }
  read_times(directory + "/frames.csv", tiles);
  if (const Status s = image::write_png(directory + "/images/wall.png", canvas->view()); !s) return s.error();
  return tiles;
}

Status keep_barrier(const std::string& run_directory, const std::string& barrier) {
  return barrier.empty() ? ok_status() : keep_copy(barrier, run_directory + "/barrier.toml");
}

Status keep_description(const std::string& run_directory, const std::string& wall) {
  return viewer::is_description(wall) ? keep_copy(wall, run_directory + "/wall.toml") : ok_status();
}

}  // namespace telesplat::launcher
