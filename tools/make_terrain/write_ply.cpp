#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/core/whole_file.h"
#include "tools/make_terrain/terrain.h"

namespace telesplat::terrain {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they lie in memory");

std::string header(const Grid& grid) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made-up caldera; metres, z up\nelement vertex {}\nproperty float "
      "x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      grid.vertices(), grid.triangles);
}

}  // namespace

uint64_t ply_bytes(const Grid& grid) {
  return header(grid).size() + grid.vertices() * sizeof(Vertex) + grid.triangles * sizeof(Face);
}

Status check_room(const std::string& path, uint64_t bytes) {
  std::error_code error;
  const auto room = std::filesystem::space(std::filesystem::absolute(path, error).parent_path(), error);
  if (error) return Error{fmt::format("{}: cannot be written: {}", path, error.message())};
  if (room.available >= bytes || room.capacity == 0) return ok_status();  // 0: the file system does not say
  return Error{fmt::format("{}: needs {:.2f} GB, its disk has {:.2f} GB free", path, double(bytes) * 1e-9,
                           double(room.available) * 1e-9)};
}

Status write_ply(const Terrain& terrain, const std::string& path, const Progress& progress, uint64_t band_rows) {
  const auto part = new_part(path);
  if (!part) return part.error();
  errno = 0;
  std::ofstream file(*part, std::ios::binary);
  file << header(terrain.grid());
  const uint64_t rows = terrain.grid().vertex_rows();
  const auto put_bands = [&](double from, double to, const auto& records_of) {
    for (uint64_t row = 0, end = 0; file && row < rows; row = end) {
      end = std::min(row + band_rows, rows);
      const auto records = records_of(row, end);
      file.write(reinterpret_cast<const char*>(records.data()), std::streamsize(records.size() * sizeof records[0]));
      if (file && !progress(from + (to - from) * double(end) / double(rows)))
        errno = ECANCELED, file.setstate(std::ios::failbit);
    }
  };
  put_bands(0, 0.9, [&](uint64_t first, uint64_t last) { return terrain.vertices(first, last); });
  put_bands(0.9, 1, [&](uint64_t first, uint64_t last) { return terrain.faces(first, last); });
  file.close();
  if (file && std::rename(part->c_str(), path.c_str()) == 0) return ok_status();
  const int error = errno;
  std::remove(part->c_str());
  return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(error))};
}

}  // namespace telesplat::terrain
