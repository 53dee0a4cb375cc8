#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>

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

class File {
 public:
  explicit File(const std::string& path) : file_(std::fopen(path.c_str(), "wb")) {}
  ~File() {
    if (file_) std::fclose(file_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  bool write(const void* data, size_t bytes) { return file_ && std::fwrite(data, 1, bytes, file_) == bytes; }
  bool close() {
    const bool closed = file_ && std::fclose(file_) == 0;
    file_ = nullptr;
    return closed;
  }

 private:
  std::FILE* file_;
};

// Writes `count` records, made one by one, in pieces.
template <class Record, class Make>
bool write_records(File& file, size_t count, const Make& make, const std::function<void(size_t)>& done) {
  constexpr size_t kPiece = 1 << 16;
  std::vector<Record> piece;
  for (size_t first = 0; first < count; first += kPiece) {
    piece.resize(std::min(kPiece, count - first));
    for (size_t i = 0; i < piece.size(); ++i) piece[i] = make(first + i);
    if (!file.write(piece.data(), piece.size() * sizeof(Record))) return false;
    done(first);
  }
  return true;
}

}  // namespace

Status write_ply(const Terrain& terrain, const std::string& path, const std::function<void(double)>& progress) {
  const size_t vertices = terrain.positions.size(), triangles = terrain.indices.size() / 3;
  const std::string part = path + ".part";
  errno = 0;
  File file(part);
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made-up caldera; metres, z up\nelement vertex {}\nproperty float "
      "x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      vertices, triangles);
  const auto tell = [&](size_t done) {
    if (progress) progress(static_cast<double>(done) / static_cast<double>(vertices + triangles));
  };
  const auto vertex = [&](size_t i) {
    const glm::vec3& p = terrain.positions[i];
    const uint32_t c = terrain.colours[i];
    return VertexRecord{{p.x, p.y, p.z},
                        {static_cast<uint8_t>(c >> 16), static_cast<uint8_t>(c >> 8), static_cast<uint8_t>(c)}};
  };
  const auto face = [&](size_t i) {
    return FaceRecord{3, {terrain.indices[3 * i], terrain.indices[3 * i + 1], terrain.indices[3 * i + 2]}};
  };
  const bool written = file.write(header.data(), header.size()) &&
                       write_records<VertexRecord>(file, vertices, vertex, tell) &&
                       write_records<FaceRecord>(file, triangles, face, [&](size_t done) { tell(vertices + done); }) &&
                       file.close() && std::rename(part.c_str(), path.c_str()) == 0;
  if (!written) {
    const int error = errno;
    std::remove(part.c_str());
    return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(error))};
  }
  return ok_status();
}

}  // namespace telesplat::terrain
