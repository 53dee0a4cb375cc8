#include "common/geometry/mesh_chunk.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace telesplat::geometry {

Result<MeshChunkView> MeshChunkView::validate(std::span<const std::byte> bytes) {
  if (bytes.size() < sizeof(ChunkHeader))
    return Error{fmt::format("chunk of {} bytes is shorter than its header", bytes.size())};
  CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % 4 == 0);
  ChunkHeader h;
  std::memcpy(&h, bytes.data(), sizeof h);
  if (h.magic != kChunkMagic) return Error{fmt::format("chunk has magic {:#x} instead of {:#x}", h.magic, kChunkMagic)};
  if (h.vertices == 0 || h.vertices > kMaxChunkVertices || h.triangles == 0 || h.triangles > kMaxChunkTriangles)
    return Error{fmt::format("chunk says {} vertices and {} triangles, limits are 1..{} and 1..{}", h.vertices,
                             h.triangles, kMaxChunkVertices, kMaxChunkTriangles)};
  if (bytes.size() != chunk_bytes(h.vertices, h.triangles))
    return Error{
        fmt::format("chunk has {} bytes, its header says {}", bytes.size(), chunk_bytes(h.vertices, h.triangles))};
  if (h.scalars > 1) return Error{fmt::format("chunk has colours of the unknown kind {}", h.scalars)};
  const auto* words = reinterpret_cast<const uint32_t*>(bytes.data() + sizeof h);
  const size_t v = h.vertices;
  MeshChunkView out;
  out.box_room = {{h.lo[0], h.lo[1], h.lo[2]}, {h.hi[0], h.hi[1], h.hi[2]}};
  out.positions_room = {reinterpret_cast<const float*>(words), 3 * v};
  out.normals = {words + 3 * v, v};
  out.colours = {words + 4 * v, v};
  out.indices = {words + 5 * v, 3 * size_t{h.triangles}};
  out.scalars = h.scalars == 1;
  bool finite = true;
  for (float p : out.positions_room) finite &= std::isfinite(p);
  if (!finite) return Error{"chunk holds a position that is not finite"};
  uint32_t largest = 0;
  for (uint32_t i : out.indices) largest = std::max(largest, i);
  if (largest >= v) return Error{fmt::format("chunk index {} is not below its {} vertices", largest, v)};
  return out;
}

std::vector<std::byte> build_chunk(std::span<const float> positions_room, std::span<const uint32_t> normals,
                                   std::span<const uint32_t> colours, std::span<const uint32_t> indices, bool scalars) {
  const size_t v = normals.size();
  CHECK(positions_room.size() == 3 * v && colours.size() == v && indices.size() % 3 == 0);
  CHECK(v >= 1 && v <= kMaxChunkVertices && indices.size() >= 3 && indices.size() / 3 <= kMaxChunkTriangles);
  Box box;
  for (size_t i = 0; i < v; ++i)
    box.extend(glm::vec3(positions_room[3 * i], positions_room[3 * i + 1], positions_room[3 * i + 2]));
  ChunkHeader h;
  h.vertices = static_cast<uint32_t>(v);
  h.triangles = static_cast<uint32_t>(indices.size() / 3);
  h.scalars = scalars;
  for (int a = 0; a < 3; ++a) h.lo[a] = box.lo[a], h.hi[a] = box.hi[a];
  std::vector<std::byte> out(chunk_bytes(v, h.triangles));
  std::byte* p = out.data();
  const auto put = [&p](const void* data, size_t bytes) {
    std::memcpy(p, data, bytes);
    p += bytes;
  };
  put(&h, sizeof h);
  put(positions_room.data(), positions_room.size_bytes());
  put(normals.data(), normals.size_bytes());
  put(colours.data(), colours.size_bytes());
  put(indices.data(), indices.size_bytes());
  return out;
}

}  // namespace telesplat::geometry
