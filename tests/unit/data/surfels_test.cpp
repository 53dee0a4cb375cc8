// Surfels of a mesh: means of its surface, as many as asked for, on both sides of a wall.
#include "services/data/mesh/out_of_core/surfels.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "tests/support/mesh_chunks.h"

namespace telesplat::data::test {
namespace {

using telesplat::test::ChunkList;
using telesplat::test::Vertex;

Surfels make(const ChunkList& chunks, size_t most) {
  std::vector<geometry::HeldChunk> held;
  std::vector<geometry::MeshChunkView> views;
  geometry::Box box;
  for (const auto& [id, chunk] : chunks) {
    held.push_back(*geometry::decode_chunk(chunk.bytes));
    views.push_back(held.back().view);
    box.extend(views.back().box_room.lo), box.extend(views.back().box_room.hi);
  }
  return make_surfels(views, box, most);
}

// A ball of 0.3 m, its colour by height: red below, blue above.
ChunkList ball(uint32_t rings) {
  std::vector<Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i <= rings; ++i)
    for (uint32_t k = 0; k <= 2 * rings; ++k) {
      const double a = M_PI * i / rings, b = M_PI * k / rings;
      const glm::vec3 n(std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b));
      vertices.push_back({0.3f * n, n, n.y > 0 ? 0x0000ffu : 0xff0000u});
      if (i == rings || k == 2 * rings) continue;
      const uint32_t at = i * (2 * rings + 1) + k, below = at + 2 * rings + 1;
      indices.insert(indices.end(), {at, at + 1, below, at + 1, below + 1, below});
    }
  return {{ChunkId{0}, telesplat::test::chunk_of(vertices, indices)}};
}

TEST(Surfels, LieOnTheSurfaceWithItsNormalsAndColours) {
  const Surfels made = make(ball(60), 3000);
  const float cell = made.spacing_m;
  for (size_t i = 0; i < made.positions.size(); ++i) {
    const glm::vec3 p = made.positions[i], n = image::decode_normal32(made.normals[i]);
    EXPECT_NEAR(glm::length(p), 0.3f, 0.3f * cell);
    EXPECT_GT(glm::dot(n, glm::normalize(p)), 0.9f);
    if (std::abs(p.y) > cell) {
      EXPECT_EQ(made.colours[i], p.y > 0 ? 0x0000ffu : 0xff0000u);
    }
  }
}

TEST(Surfels, AreAboutAsManyAsAskedFor) {
  for (const size_t most : {200, 2000, 20000}) {
    EXPECT_NEAR(double(make(ball(100), most).positions.size()), double(most), 0.35 * double(most));
    EXPECT_NEAR(double(make(telesplat::test::terrain(150, 50), most).positions.size()), double(most),
                0.35 * double(most));
  }
}

TEST(Surfels, LeaveNoCellOfALargeTriangleOut) {
  const ChunkList one{
      {ChunkId{0}, telesplat::test::triangle({{0, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 1, 0}}, {{3, 0, 0}, {0, 1, 0}})}};
  const Surfels made = make(one, 1000);
  for (float x = 0.1f; x < 2.8f; x += 0.05f) {
    const glm::vec3 at(x, 0, 0.45f * (1 - x / 3));
    float nearest = 9;
    for (size_t i = 0; i < made.positions.size(); ++i)
      nearest = std::min(nearest, glm::distance(at, made.positions[i]));
    EXPECT_LT(nearest, made.spacing_m) << x;
  }
}

TEST(Surfels, KeepBothSidesOfAThinWall) {
  ChunkList wall;
  for (const float side : {1.0f, -1.0f})
    wall.emplace_back(ChunkId{wall.size()}, telesplat::test::chunk_of({{{0, 0, 0.001f * side}, {0, 0, side}},
                                                                       {{1, 0, 0.001f * side}, {0, 0, side}},
                                                                       {{0, 1, 0.001f * side}, {0, 0, side}}},
                                                                      {0, 1, 2}));
  const Surfels made = make(wall, 500);
  size_t front = 0, back = 0;
  for (size_t i = 0; i < made.positions.size(); ++i) {
    const float z = image::decode_normal32(made.normals[i]).z;
    EXPECT_GT(std::abs(z), 0.99f);
    ++(z > 0 ? front : back);
  }
  EXPECT_NEAR(double(front), double(back), 0.1 * double(front));
}

TEST(Surfels, ScalarsAreMeansOfThoseThatExist) {
  const auto bits = [](float v) { return std::bit_cast<uint32_t>(v); };
  const float none = std::numeric_limits<float>::quiet_NaN();
  const auto one = [&](float z, float value) {
    return telesplat::test::chunk_of({{{0, 0, z}, {0, 0, 1}, bits(value)},
                                      {{0.001f, 0, z}, {0, 0, 1}, bits(value)},
                                      {{0, 0.001f, z}, {0, 0, 1}, bits(value)}},
                                     {0, 1, 2}, true);
  };
  const Surfels made = make({{ChunkId{0}, one(0, 4)}, {ChunkId{1}, one(1, none)}}, 2);
  ASSERT_EQ(made.positions.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    const float value = std::bit_cast<float>(made.colours[i]);
    if (made.positions[i].z < 0.5f)
      EXPECT_FLOAT_EQ(value, 4);
    else
      EXPECT_TRUE(std::isnan(value));
  }
}

TEST(Surfels, TheSameChunksGiveTheSameSurfels) {
  const ChunkList chunks = telesplat::test::terrain(80, 16);
  const Surfels a = make(chunks, 1500), b = make(chunks, 1500);
  EXPECT_TRUE(a.positions == b.positions && a.normals == b.normals && a.colours == b.colours);
}

}  // namespace
}  // namespace telesplat::data::test
