// Coded chunks: mesh chunks as they lie in the chunk store's file and travel to samplers, at a third of their size.
//
// Attributes and indices go through meshoptimizer's codecs of vertices and of triangles, which lose nothing. Chunks of
// 65536 triangles take 9 to 13 bytes a triangle with their levels, 0.1 s a million triangles to code and 0.02 s to
// decode, on one core. Little-endian.
//
//   offset       type               what
//   0            CodedChunkHeader   52 bytes
//   52           streams            positions, normals, colours, as meshopt_encodeVertexBuffer() makes them of elements
//                                   of 12, 4 and 4 bytes; their sizes stand in the header
//   then         stream             vertex indices, as meshopt_encodeIndexBuffer() makes them, to the end
#pragma once

#include "common/geometry/mesh_chunk.h"

namespace telesplat::geometry {

inline constexpr uint32_t kCodedChunkMagic = 0x43435354;  // "TSCC"

struct CodedChunkHeader {
  uint32_t magic = kCodedChunkMagic;
  uint32_t vertices = 0, triangles = 0, scalars = 0;  ///< as in ChunkHeader
  float lo[3] = {}, hi[3] = {};
  uint32_t stream_bytes[3] = {};  ///< positions, normals, colours
};
static_assert(sizeof(CodedChunkHeader) == 52);

/// Codes a chunk. It decodes to the same bytes, except that the corners of a triangle may be turned: (b, c, a).
std::vector<std::byte> encode_chunk(const MeshChunkView& chunk);

/// A valid chunk, and the owner that keeps its bytes alive.
struct HeldChunk {
  MeshChunkView view;
  std::shared_ptr<const void> owner;
};

/// Decodes and validates a chunk. The bytes may be anything and lie anywhere. Allocates the decoded chunk, once its
/// counts are within the limits and no larger than such bytes can hold.
Result<HeldChunk> decode_chunk(std::span<const std::byte> coded);

/// Returns the bytes that a coded chunk has once it is decoded; 0: its header is not valid.
size_t decoded_bytes(std::span<const std::byte> coded);

}  // namespace telesplat::geometry
