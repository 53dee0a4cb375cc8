// Coarse nodes of a mesh: close to its surface, without gaps, with what is thinner than their cells.
#include "services/data/mesh/levels.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "common/geometry/trajectory.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::data::test {
namespace {

using geometry::MeshChunkView;
using telesplat::test::ChunkList;
using telesplat::test::Vertex;

struct Level {
  ChunkList chunks;
  std::vector<float> spacings_m;
};

Level leaves(ChunkList chunks) {
  const size_t count = chunks.size();
  return {std::move(chunks), std::vector<float>(count, 0.0f)};
}

CoarseNode node_of(const Level& level, size_t first, size_t last, size_t most) {
  std::vector<geometry::Box> boxes;
  for (const auto& [id, chunk] : level.chunks) boxes.push_back(geometry::decode_chunk(chunk.bytes)->view.box_room);
  return make_coarse_node(
      {boxes, level.spacings_m, [&](size_t i) { return *geometry::decode_chunk(level.chunks[i].second.bytes); }}, first,
      last, most);
}

Level above(const Level& below, size_t most) {
  Level out;
  for (size_t first = 0; first < below.chunks.size(); first += kChildren) {
    CoarseNode node = node_of(below, first, std::min(first + kChildren, below.chunks.size()), most);
    EXPECT_FALSE(node.chunk.empty());
    out.chunks.emplace_back(ChunkId{first / kChildren}, telesplat::test::coded(node.chunk));
    out.spacings_m.push_back(node.spacing_m);
  }
  return out;
}

image::DepthImage picture(const ChunkList& chunks, const geometry::Camera& camera) {
  const auto sampler = sampler::make_ray_sampler(1);
  EXPECT_TRUE(sampler->add_chunks(chunks).ok());
  return sampler->sample(camera, {0, 0, camera.width, camera.height});
}
size_t covered(const image::DepthImage& image) {
  return image.pixels() - size_t(std::count(image.depth.begin(), image.depth.end(), 0u));
}

// 64 pieces of 128 triangles that meet at their borders, four by four as in a row of a square.
Level terrain() { return leaves(telesplat::test::terrain(64, 8)); }

TEST(Levels, HaveAFourthOfTheTrianglesAtMostAndTwiceTheSpacing) {
  const Level low = above(terrain(), 1000), high = above(low, 1000);
  EXPECT_EQ(low.chunks.size(), 16u);
  EXPECT_EQ(high.chunks.size(), 4u);
  for (const auto& [id, chunk] : low.chunks) EXPECT_LT(geometry::decode_chunk(chunk.bytes)->view.triangles(), 256u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_GT(high.spacings_m[i], 1.29f * low.spacings_m[4 * i]);
    EXPECT_LT(high.spacings_m[i], 0.1f);
  }
}

TEST(Levels, LieCloseToTheSurfaceAndLeaveNoGaps) {
  const Level fine = terrain();
  const geometry::Camera camera = geometry::make_camera(geometry::look_at({0.3, 1, 0.4}, {0, 0, 0}), 60, 200, 200);
  const image::DepthImage truth = picture(fine.chunks, camera);
  Level level = fine;
  for (int n = 0; n < 2; ++n) {
    level = above(level, 1000);
    const float spacing_m = *std::max_element(level.spacings_m.begin(), level.spacings_m.end());
    const image::DepthImage coarse = picture(level.chunks, camera);
    for (size_t i = 0; i < truth.pixels(); ++i) {
      if (truth.depth[i] == 0) continue;
      const double depth_m = image::decode_depth(truth.depth[i], camera.near_m);
      const glm::dvec3 p = camera.unproject(double(i % 200) + 0.5, double(i / 200) + 0.5, depth_m);
      if (std::max(std::abs(p.x), std::abs(p.z)) > 0.4 - spacing_m) continue;  // the mesh's border may shrink by a cell
      ASSERT_NE(coarse.depth[i], 0u) << "level " << n + 1 << ", pixel " << i % 200 << ", " << i / 200;
      ASSERT_NEAR(image::decode_depth(coarse.depth[i], camera.near_m), depth_m, 1.5 * spacing_m);
    }
    EXPECT_GT(double(covered(coarse)), std::pow(1 - spacing_m / 0.8, 2) * double(covered(truth)));
  }
}

// Nodes of other levels may stand beside a node: it goes a cell beyond its border.
TEST(Levels, OverlapTheirNeighbours) {
  const Level fine = terrain();
  const CoarseNode node = node_of(fine, 0, 4, 1000);
  geometry::Box own;
  for (size_t i = 0; i < 4; ++i) own.extend(geometry::decode_chunk(fine.chunks[i].second.bytes)->view.box_room);
  const geometry::Box box = MeshChunkView::validate(node.chunk)->box_room;
  EXPECT_GT(box.hi.x, own.hi.x + 0.2f * node.spacing_m);
  EXPECT_GT(box.hi.z, own.hi.z + 0.2f * node.spacing_m);
  EXPECT_LT(box.hi.x, own.hi.x + 3 * node.spacing_m);
}

// A wire of a twentieth of a cell: clustered, its triangles have no area.
TEST(Levels, KeepWhatIsThinnerThanACell) {
  constexpr int kSides = 8, kLength = 2000;
  std::vector<Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i <= kLength; ++i)
    for (uint32_t k = 0; k < kSides; ++k) {
      const double a = 2 * M_PI * k / kSides, along = 0.8 * i / kLength - 0.4;
      const glm::vec3 n(0, std::cos(a), std::sin(a));
      vertices.push_back({glm::vec3(along, 0.1 * std::sin(9 * along), 0) + 0.0004f * n, n});
      if (i == kLength) continue;
      const uint32_t at = i * kSides + k, beside = i * kSides + (k + 1) % kSides;
      indices.insert(indices.end(), {at, beside, at + kSides, beside, beside + kSides, at + kSides});
    }
  const Level fine = leaves({{ChunkId{0}, telesplat::test::chunk_of(vertices, indices)}});
  const CoarseNode node = node_of(fine, 0, 1, 200);
  ASSERT_FALSE(node.chunk.empty());
  ASSERT_GT(node.spacing_m, 10 * 0.0008f);
  const ChunkList coarse{{ChunkId{0}, telesplat::test::coded(node.chunk)}};
  for (const glm::dvec3& eye : {glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 0), glm::dvec3(0.3, 0.8, -0.6)}) {
    const geometry::Camera camera = geometry::make_camera(geometry::look_at(eye, {0, 0, 0}), 60, 2000, 1200);
    const auto truth = double(covered(picture(fine.chunks, camera)));
    EXPECT_NEAR(double(covered(picture(coarse, camera))), truth, 0.5 * truth);
  }
}

TEST(Levels, MixColoursAndNormalsByArea) {
  // A flat chequerboard of red and blue, 100 x 100 fields of four triangles.
  std::vector<Vertex> vertices;
  std::vector<uint32_t> indices;
  for (int k = 0; k < 100; ++k)
    for (int i = 0; i < 100; ++i) {
      const uint32_t colour = (i + k) % 2 ? 0xff0000 : 0x0000ff, first = uint32_t(vertices.size());
      for (const auto& [x, z] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
        vertices.push_back({{0.01f * float(i + x), 0, 0.01f * float(k + z)}, {0, 1, 0}, colour});
      indices.insert(indices.end(), {first, first + 2, first + 1, first, first + 3, first + 2});
    }
  const CoarseNode node = node_of(leaves({{ChunkId{0}, telesplat::test::chunk_of(vertices, indices)}}), 0, 1, 600);
  const auto view = MeshChunkView::validate(node.chunk);
  ASSERT_TRUE(view);
  size_t mixed = 0;
  for (size_t v = 0; v < view->vertices(); ++v) {
    EXPECT_GT(image::decode_normal32(view->normals[v]).y, 0.999f);
    const int red = int(view->colours[v] >> 16), blue = int(view->colours[v] & 255);
    mixed += std::abs(red - 128) < 40 && std::abs(blue - 128) < 40;
  }
  EXPECT_GT(mixed, view->vertices() * 9 / 10);
}

TEST(Levels, ScalarsAreMeansOfThoseThatExist) {
  const auto bits = [](float v) { return std::bit_cast<uint32_t>(v); };
  std::vector<Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t k = 0; k <= 60; ++k)
    for (uint32_t i = 0; i <= 60; ++i) {
      const float none = std::numeric_limits<float>::quiet_NaN();
      vertices.push_back({{float(i), 0, float(k)}, {0, 1, 0}, bits(i < 30 ? (k % 2 ? 2.0f : 4.0f) : none)});
      const uint32_t at = k * 61 + i;
      if (i < 60 && k < 60) indices.insert(indices.end(), {at, at + 61, at + 1, at + 1, at + 61, at + 62});
    }
  const CoarseNode node =
      node_of(leaves({{ChunkId{0}, telesplat::test::chunk_of(vertices, indices, true)}}), 0, 1, 400);
  const auto view = MeshChunkView::validate(node.chunk);
  ASSERT_TRUE(view);
  EXPECT_TRUE(view->scalars);
  for (size_t v = 0; v < view->vertices(); ++v) {
    const float value = std::bit_cast<float>(view->colours[v]), x = view->positions_room[3 * v];
    if (x > 30 + node.spacing_m)
      EXPECT_TRUE(std::isnan(value)) << x;
    else if (x < 30 - node.spacing_m)
      EXPECT_NEAR(value, 3, 0.5) << x;
  }
}

// Large triangles stay as they are: a floor of two is not torn.
TEST(Levels, KeepLargeTrianglesBesideSmallOnes) {
  ChunkList chunks = telesplat::test::terrain(64, 64);
  chunks.emplace_back(
      ChunkId{1},
      telesplat::test::chunk_of(
          {{{-5, -1, -5}, {0, 1, 0}}, {{5, -1, -5}, {0, 1, 0}}, {{5, -1, 5}, {0, 1, 0}}, {{-5, -1, 5}, {0, 1, 0}}},
          {0, 2, 1, 0, 3, 2}));
  const CoarseNode node = node_of(leaves(chunks), 0, 2, 1000);
  ASSERT_FALSE(node.chunk.empty());
  const geometry::Camera down = geometry::make_camera(geometry::look_at({2, 3, 2}, {2, -1, 2.01}), 40, 64, 64);
  EXPECT_EQ(covered(picture({{ChunkId{0}, telesplat::test::coded(node.chunk)}}, down)), 64u * 64u);
}

TEST(Levels, TheSameChunksGiveTheSameBytes) {
  const Level fine = terrain();
  EXPECT_EQ(node_of(fine, 4, 8, 1000).chunk, node_of(fine, 4, 8, 1000).chunk);
}

}  // namespace
}  // namespace telesplat::data::test
