#include "common/geometry/chunk_code.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cstring>

namespace telesplat::geometry {
namespace {

constexpr size_t kStrides[3] = {12, 4, 4};  // bytes a vertex: positions, normals, colours

unsigned char* bytes_at(std::byte* p) { return reinterpret_cast<unsigned char*>(p); }
const unsigned char* bytes_at(const std::byte* p) { return reinterpret_cast<const unsigned char*>(p); }

Result<CodedChunkHeader> header_of(std::span<const std::byte> coded) {
  CodedChunkHeader h;
  if (coded.size() < sizeof h)
    return Error{fmt::format("coded chunk of {} bytes is shorter than its header", coded.size())};
  std::memcpy(&h, coded.data(), sizeof h);
  if (h.magic != kCodedChunkMagic)
    return Error{fmt::format("coded chunk has magic {:#x} instead of {:#x}", h.magic, kCodedChunkMagic)};
  if (h.vertices == 0 || h.vertices > kMaxChunkVertices || h.triangles == 0 || h.triangles > kMaxChunkTriangles)
    return Error{fmt::format("coded chunk says {} vertices and {} triangles, limits are 1..{} and 1..{}", h.vertices,
                             h.triangles, kMaxChunkVertices, kMaxChunkTriangles)};
  // A triangle takes a byte or more. 256 vertices that are equal take 80 bytes.
  const size_t rest = coded.size() - sizeof h;
  if (h.triangles > rest || h.vertices / 4 > rest)
    return Error{fmt::format("coded chunk says {} vertices and {} triangles, which {} bytes cannot hold", h.vertices,
                             h.triangles, coded.size())};
  if (size_t{h.stream_bytes[0]} + h.stream_bytes[1] + h.stream_bytes[2] > rest)
    return Error{fmt::format("streams of a coded chunk go beyond its {} bytes", coded.size())};
  return h;
}

}  // namespace

std::vector<std::byte> encode_chunk(const MeshChunkView& chunk) {
  const size_t vertices = chunk.vertices(), indices = chunk.indices.size();
  const void* attributes[3] = {chunk.positions_room.data(), chunk.normals.data(), chunk.colours.data()};
  CodedChunkHeader h{.vertices = static_cast<uint32_t>(vertices),
                     .triangles = static_cast<uint32_t>(chunk.triangles()),
                     .scalars = chunk.scalars};
  for (int a = 0; a < 3; ++a) h.lo[a] = chunk.box_room.lo[a], h.hi[a] = chunk.box_room.hi[a];
  size_t most = sizeof h + meshopt_encodeIndexBufferBound(indices, vertices);
  for (const size_t stride : kStrides) most += meshopt_encodeVertexBufferBound(vertices, stride);
  std::vector<std::byte> out(most);
  size_t end = sizeof h;
  const auto room = [&] { return std::pair(bytes_at(out.data() + end), most - end); };
  for (size_t a = 0; a < 3; ++a) {
    const auto [to, bytes] = room();
    const size_t taken = meshopt_encodeVertexBuffer(to, bytes, attributes[a], vertices, kStrides[a]);
    h.stream_bytes[a] = static_cast<uint32_t>(taken);
    end += taken;
  }
  const auto [to, bytes] = room();
  end += meshopt_encodeIndexBuffer(to, bytes, chunk.indices.data(), indices);
  std::memcpy(out.data(), &h, sizeof h);
  out.resize(end);
  out.shrink_to_fit();
  return out;
}

Result<HeldChunk> decode_chunk(std::span<const std::byte> coded) {
  const auto coding = header_of(coded);
  if (!coding) return coding.error();
  ChunkHeader h{.vertices = coding->vertices, .triangles = coding->triangles, .scalars = coding->scalars};
  std::copy_n(coding->lo, 3, h.lo);
  std::copy_n(coding->hi, 3, h.hi);
  const auto out = std::make_shared<std::vector<std::byte>>(chunk_bytes(h.vertices, h.triangles));
  std::memcpy(out->data(), &h, sizeof h);
  std::byte* to = out->data() + sizeof h;
  auto rest = coded.subspan(sizeof *coding);
  for (size_t a = 0; a < 3; ++a) {
    const size_t bytes = coding->stream_bytes[a];
    if (const int error = meshopt_decodeVertexBuffer(to, h.vertices, kStrides[a], bytes_at(rest.data()), bytes))
      return Error{fmt::format("stream {} of a coded chunk is damaged: error {}", a, error)};
    to += kStrides[a] * h.vertices;
    rest = rest.subspan(bytes);
  }
  if (const int error = meshopt_decodeIndexBuffer(to, 3 * size_t{h.triangles}, 4, bytes_at(rest.data()), rest.size()))
    return Error{fmt::format("indices of a coded chunk are damaged: error {}", error)};
  const auto view = MeshChunkView::validate(*out);
  if (!view) return view.error();
  return HeldChunk{*view, out};
}

size_t decoded_bytes(std::span<const std::byte> coded) {
  const auto h = header_of(coded);
  return h ? chunk_bytes(h->vertices, h->triangles) : 0;
}

}  // namespace telesplat::geometry
