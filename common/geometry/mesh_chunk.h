// Mesh chunks: the blocks that a data server stores and serves, and a sampler traces.
//
// The chunks of a mesh are a tree: leaves hold its triangles, inner nodes a coarse form of what is below them.
//
// One chunk is one contiguous block of bytes, which Embree and OpenGL read where it lies. In the chunk store's file and
// on the wire it is coded (chunk_code.h). Little-endian. All positions are in room space.
//
//   offset                          type            what
//   0                               ChunkHeader     64 bytes
//   64                              float[3][V]     positions, metres
//   64 + 12 V                       uint32[V]       normals, octahedral, 2 x 16 bits (image/normal.h: encode_normal32)
//   64 + 16 V                       uint32[V]       colours, 0x00RRGGBB, unlit albedo; or, with ChunkHeader::scalars,
//                                                   float[V] scalars (NaN: none) that a colouring turns into colours
//   64 + 20 V                       uint32[3][T]    vertex indices, each < V
//   64 + 20 V + 12 T                zero bytes      to a multiple of 64, at least 16 (Embree reads beyond the end)
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::geometry {

inline constexpr uint32_t kChunkMagic = 0x4b435354;  // "TSCK"
inline constexpr uint32_t kMaxChunkVertices = 1u << 22;
inline constexpr uint32_t kMaxChunkTriangles = 1u << 22;
inline constexpr size_t kMaxChunks = 1u << 16;

struct ChunkHeader {
  uint32_t magic = kChunkMagic;
  uint32_t vertices = 0;
  uint32_t triangles = 0;
  uint32_t scalars = 0;  ///< 1: the colours are scalars, 0: colours
  float lo[3] = {}, hi[3] = {};
  uint32_t reserved1[6] = {};
};
static_assert(sizeof(ChunkHeader) == 64);

/// Bytes of a chunk with V vertices and T triangles, padding included.
constexpr size_t chunk_bytes(size_t vertices, size_t triangles) {
  return (64 + 20 * vertices + 12 * triangles + 16 + 63) / 64 * 64;
}

/// A validated chunk: spans into bytes (4-byte aligned) that must outlive it.
struct MeshChunkView {
  Box box_room;
  std::span<const float> positions_room;  ///< 3 V
  std::span<const uint32_t> normals;      ///< V
  std::span<const uint32_t> colours;      ///< V; scalars: the bits of floats
  std::span<const uint32_t> indices;      ///< 3 T
  bool scalars = false;
  size_t vertices() const { return normals.size(); }
  size_t triangles() const { return indices.size() / 3; }

  /// Checks magic, counts against the limits and against bytes.size(), every index < V, every position finite.
  /// Allocates nothing. Precondition: bytes.data() is 4-byte aligned; the content may be anything.
  static Result<MeshChunkView> validate(std::span<const std::byte> bytes);
};

/// Description of a chunk that a data server sends before its bytes. A list of chunks is in the order of their ids,
/// from 0 on. An inner node has the chunks [first_child, first_child + children) below it, which come before it in the
/// list, and after those of the nodes before it.
struct ChunkInfo {
  ChunkId id;
  Box box_room;
  uint64_t triangles = 0;
  uint64_t bytes = 0;   ///< coded
  float spacing_m = 0;  ///< how far apart its vertices lie where they stand for finer ones; 0: a leaf
  uint32_t first_child = 0, children = 0;
  bool is_leaf() const { return children == 0; }
  bool operator==(const ChunkInfo&) const = default;
};

/// Lays out one chunk. normals and colours have one entry a vertex, as in the table above; scalars: the colours are
/// scalars. Preconditions: counts within the limits, indices < vertices.
std::vector<std::byte> build_chunk(std::span<const float> positions_room, std::span<const uint32_t> normals,
                                   std::span<const uint32_t> colours, std::span<const uint32_t> indices,
                                   bool scalars = false);

/// Bytes of a chunk, coded or not, and an owner that keeps them alive (a mapped file, a received message, a vector).
struct ChunkBytes {
  std::span<const std::byte> bytes;
  std::shared_ptr<const void> owner;
};

}  // namespace telesplat::geometry
