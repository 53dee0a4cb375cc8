// Small meshes as coded chunks, for tests and benchmarks.
#pragma once

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"

namespace telesplat::test {

using ChunkList = std::vector<std::pair<ChunkId, geometry::ChunkBytes>>;

struct Vertex {
  glm::vec3 position_room, normal;
  uint32_t colour = 0x808080;
};

/// Codes a chunk that build_chunk() or another function laid out.
inline geometry::ChunkBytes coded(std::span<const std::byte> chunk) {
  const auto bytes =
      std::make_shared<std::vector<std::byte>>(geometry::encode_chunk(*geometry::MeshChunkView::validate(chunk)));
  return {*bytes, bytes};
}

/// scalars: colours are the bits of floats.
inline geometry::ChunkBytes chunk_of(const std::vector<Vertex>& vertices, const std::vector<uint32_t>& indices,
                                     bool scalars = false) {
  std::vector<float> positions;
  std::vector<uint32_t> normals, colours;
  for (const Vertex& v : vertices) {
    for (int a = 0; a < 3; ++a) positions.push_back(v.position_room[a]);
    normals.push_back(image::encode_normal32(v.normal));
    colours.push_back(v.colour);
  }
  return coded(geometry::build_chunk(positions, normals, colours, indices, scalars));
}

/// One triangle, counter-clockwise seen from its normal.
inline geometry::ChunkBytes triangle(const Vertex& a, const Vertex& b, const Vertex& c) {
  return chunk_of({a, b, c}, {0, 1, 2});
}

/// A hilly square of 0.8 m around the origin: 2 * side * side triangles in chunks of up to 2 * part * part.
/// Heights, normals and colours are smooth functions, so that neighbouring chunks meet.
inline ChunkList terrain(int side, int part) {
  const auto height = [](float x, float z) {
    float sum = 0, amplitude = 0.05f, frequency = 8;
    for (int octave = 0; octave < 6; ++octave, amplitude *= 0.45f, frequency *= 2.1f)
      sum += amplitude * std::sin(frequency * x + 1.3f * octave + std::sin(0.7f * frequency * z)) *
             std::cos(frequency * z + 2.1f * octave);
    return sum;
  };
  const auto vertex = [&](int i, int k) {
    const float x = 0.8f * i / side - 0.4f, z = 0.8f * k / side - 0.4f, h = height(x, z), step = 1e-3f;
    const glm::vec3 n = glm::normalize(glm::vec3(h - height(x + step, z), step, h - height(x, z + step)));
    const auto channel = [](float v) { return static_cast<uint32_t>(std::fmin(std::fmax(v, 0.0f), 1.0f) * 255.0f); };
    return Vertex{{x, h, z}, n, channel(0.5f + 5 * h) << 16 | channel(0.7f * n.y) << 8 | channel(0.5f - 4 * h)};
  };
  ChunkList chunks;
  for (int k0 = 0; k0 < side; k0 += part)
    for (int i0 = 0; i0 < side; i0 += part) {
      const int ni = std::min(part, side - i0), nk = std::min(part, side - k0);
      std::vector<Vertex> vertices;
      std::vector<uint32_t> indices;
      for (int k = 0; k <= nk; ++k)
        for (int i = 0; i <= ni; ++i) vertices.push_back(vertex(i0 + i, k0 + k));
      for (uint32_t k = 0; k < uint32_t(nk); ++k)
        for (uint32_t i = 0; i < uint32_t(ni); ++i) {
          const uint32_t a = k * (ni + 1) + i, b = a + ni + 1;
          indices.insert(indices.end(), {a, b, a + 1, a + 1, b, b + 1});
        }
      chunks.emplace_back(ChunkId{chunks.size()}, chunk_of(vertices, indices));
    }
  return chunks;
}

}  // namespace telesplat::test
