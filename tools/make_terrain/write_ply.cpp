#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "tools/make_terrain/terrain.h"

namespace telesplat::terrain {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they lie in memory");

#pragma pack(push, 1)
struct VertexRecord {
  float position[3];
  uint8_t colour[3];
};
struct FaceRecord {
  uint8_t corners;
  uint32_t index[3];
};
#pragma pack(pop)

}  // namespace

Status write_ply(const Terrain& terrain, const std::string& path, const std::function<void(double)>& progress) {
  constexpr size_t kPiece = 1 << 16;  // records between two reports of progress
  const size_t vertices = terrain.positions.size(), triangles = terrain.indices.size() / 3;
  const std::string part = path + ".part";
  errno = 0;
  std::ofstream file(part, std::ios::binary);
  file << fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made-up caldera; metres, z up\nelement vertex {}\nproperty float "
      "x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      vertices, triangles);
  const auto put = [&](const auto& record, size_t done) {
    file.write(reinterpret_cast<const char*>(&record), sizeof record);
    if (progress && done % kPiece == 0) progress(static_cast<double>(done) / static_cast<double>(vertices + triangles));
  };
  for (size_t i = 0; i < vertices && file; ++i) {
    const glm::vec3& p = terrain.positions[i];
    const uint32_t c = terrain.colours[i];
    put(VertexRecord{{p.x, p.y, p.z},
                     {static_cast<uint8_t>(c >> 16), static_cast<uint8_t>(c >> 8), static_cast<uint8_t>(c)}},
        i);
  }
  for (size_t i = 0; i < triangles && file; ++i) {
    const uint32_t* corners = &terrain.indices[3 * i];
    put(FaceRecord{3, {corners[0], corners[1], corners[2]}}, vertices + i);
  }
  file.close();
  if (file && std::rename(part.c_str(), path.c_str()) == 0) return ok_status();
  const int error = errno;
  std::remove(part.c_str());
  return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(error))};
}

}  // namespace telesplat::terrain
