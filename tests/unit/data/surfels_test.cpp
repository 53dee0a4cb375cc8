// Surfels of a mesh: means of its surface, as many as asked for, on both sides of a wall.
#include "services/data/mesh/surfels.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "common/geometry/surfels.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::data::test {
namespace {

using telesplat::test::ChunkList;
using telesplat::test::Vertex;

SurfelSource source_of(const ChunkList& chunks) {
  SurfelSource out;
  for (const auto& [id, chunk] : chunks) {
    const auto view = geometry::decode_chunk(chunk.bytes)->view;
    out.box_room.extend(view.box_room.lo), out.box_room.extend(view.box_room.hi);
    out.triangles += view.triangles();
  }
  out.chunks = chunks.size();
  out.chunk = [&chunks](size_t i) { return *geometry::decode_chunk(chunks[i].second.bytes); };
  return out;
}

struct Made {
  std::vector<std::byte> bytes;
  geometry::SurfelView view;
  glm::vec3 position(size_t i) const {
    return {view.positions_room[3 * i], view.positions_room[3 * i + 1], view.positions_room[3 * i + 2]};
  }
};
Made make(const ChunkList& chunks, size_t most) {
  const std::atomic<bool> stop{false};
  Made out{make_surfels(source_of(chunks), most, stop), {}};
  const auto view = geometry::SurfelView::validate(out.bytes);
  EXPECT_TRUE(view.ok());
  if (view) out.view = *view;
  return out;
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
  const Made made = make(ball(60), 3000);
  const float cell = made.view.spacing_m;
  for (size_t i = 0; i < made.view.size(); ++i) {
    const glm::vec3 p = made.position(i), n = image::decode_normal32(made.view.normals[i]);
    EXPECT_NEAR(glm::length(p), 0.3f, 0.3f * cell);
    EXPECT_GT(glm::dot(n, glm::normalize(p)), 0.9f);
    if (std::abs(p.y) > cell) {
      EXPECT_EQ(made.view.colours[i], p.y > 0 ? 0x0000ffu : 0xff0000u);
    }
  }
}

TEST(Surfels, AreAboutAsManyAsAskedFor) {
  for (const size_t most : {200, 2000, 20000}) {
    EXPECT_NEAR(double(make(ball(100), most).view.size()), double(most), 0.35 * double(most));
    EXPECT_NEAR(double(make(telesplat::test::terrain(150, 50), most).view.size()), double(most), 0.35 * double(most));
  }
}

TEST(Surfels, LeaveNoCellOfALargeTriangleOut) {
  const ChunkList one{
      {ChunkId{0}, telesplat::test::triangle({{0, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 1, 0}}, {{3, 0, 0}, {0, 1, 0}})}};
  const Made made = make(one, 1000);
  for (float x = 0.1f; x < 2.8f; x += 0.05f) {
    const glm::vec3 at(x, 0, 0.45f * (1 - x / 3));
    float nearest = 9;
    for (size_t i = 0; i < made.view.size(); ++i) nearest = std::min(nearest, glm::distance(at, made.position(i)));
    EXPECT_LT(nearest, made.view.spacing_m) << x;
  }
}

TEST(Surfels, KeepBothSidesOfAThinWall) {
  ChunkList wall;
  for (const float side : {1.0f, -1.0f})
    wall.emplace_back(ChunkId{wall.size()}, telesplat::test::chunk_of({{{0, 0, 0.001f * side}, {0, 0, side}},
                                                                       {{1, 0, 0.001f * side}, {0, 0, side}},
                                                                       {{0, 1, 0.001f * side}, {0, 0, side}}},
                                                                      {0, 1, 2}));
  const Made made = make(wall, 500);
  size_t front = 0, back = 0;
  for (size_t i = 0; i < made.view.size(); ++i) {
    const float z = image::decode_normal32(made.view.normals[i]).z;
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
  const Made made = make({{ChunkId{0}, one(0, 4)}, {ChunkId{1}, one(1, none)}}, 2);
  ASSERT_TRUE(made.view.scalars);
  ASSERT_EQ(made.view.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    const float value = std::bit_cast<float>(made.view.colours[i]);
    if (made.position(i).z < 0.5f)
      EXPECT_FLOAT_EQ(value, 4);
    else
      EXPECT_TRUE(std::isnan(value));
  }
}

TEST(Surfels, TheSameChunksGiveTheSameBytes) {
  const ChunkList chunks = telesplat::test::terrain(80, 16);
  EXPECT_EQ(make(chunks, 1500).bytes, make(chunks, 1500).bytes);
}

TEST(Surfels, AreNotMadeOnceStopped) {
  const std::atomic<bool> stop{true};
  const ChunkList chunks = ball(20);
  EXPECT_TRUE(make_surfels(source_of(chunks), 100, stop).empty());
}

TEST(SurfelSet, RefusesDamagedBytes) {
  const auto good = make(ball(20), 100).bytes;
  const auto refused = [](const std::vector<std::byte>& bytes) { return !geometry::SurfelView::validate(bytes).ok(); };
  EXPECT_FALSE(refused(good));
  EXPECT_TRUE(refused({good.begin(), good.end() - 4}));
  EXPECT_TRUE(refused({good.begin(), good.begin() + 20}));
  for (const size_t field : {0, 4, 8, 12}) {  // magic, count, scalars, spacing
    auto bad = good;
    for (size_t i = field; i < field + 4; ++i) bad[i] = std::byte{0xff};
    EXPECT_TRUE(refused(bad)) << field;
  }
  auto bad = good;
  for (size_t i = 32; i < 36; ++i) bad[i] = std::byte{0xff};  // a position that is not a number
  EXPECT_TRUE(refused(bad));
}

}  // namespace
}  // namespace telesplat::data::test
