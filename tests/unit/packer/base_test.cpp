// The base loses none of the mesh, holds what viewers ask for, and hides triangles that rays have passed.
#include "services/packer/points/base/base.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "tests/support/mesh_chunks.h"

namespace telesplat::packer {
namespace {

// Triangles with the colours of their corners, each corner at a multiple of a tenth of a millimetre.
std::multiset<std::vector<int64_t>> triangles_of(const geometry::MeshChunkView& chunk) {
  std::multiset<std::vector<int64_t>> out;
  for (size_t t = 0; t < chunk.triangles(); ++t) {
    std::vector<std::vector<int64_t>> corners;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = chunk.indices[3 * t + k];
      corners.push_back({chunk.colours[v]});
      for (size_t axis = 0; axis < 3; ++axis)
        corners.back().push_back(std::lround(1e4 * double(chunk.positions_room[3 * size_t{v} + axis])));
    }
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    std::vector<int64_t> flat;
    for (const auto& corner : corners) flat.insert(flat.end(), corner.begin(), corner.end());
    out.insert(flat);
  }
  return out;
}

geometry::MeshChunkView view_of(const geometry::ChunkBytes& chunk, geometry::HeldChunk& held) {
  held = geometry::decode_chunk(chunk.bytes).value();
  return held.view;
}
geometry::ChunkInfo leaf(uint64_t id, uint64_t triangles) {
  return {.id = {id}, .box_room = {glm::vec3(-1), glm::vec3(1)}, .triangles = triangles};
}

TEST(Base, PartsHaveEveryTriangleOfTheirChunks) {
  const auto chunks = test::terrain(100, 100);
  std::vector<geometry::ChunkInfo> nodes;
  for (const auto& [id, chunk] : chunks)
    nodes.push_back(leaf(nodes.size(), geometry::decode_chunk(chunk.bytes)->view.triangles()));
  Base base(nodes, 0.8f, nullptr);
  std::multiset<std::vector<int64_t>> wanted, told;
  for (uint32_t n = 0; n < chunks.size(); ++n) {
    geometry::HeldChunk held;
    const auto exact = view_of(chunks[n].second, held);
    // Positions that the base's steps of 2^-16 m leave as they are.
    std::vector<float> positions(exact.positions_room.begin(), exact.positions_room.end());
    for (float& p : positions) p = std::round(p * 65536) / 65536;
    const auto rounded = geometry::build_chunk(positions, exact.normals, exact.colours, exact.indices);
    const auto view = geometry::MeshChunkView::validate(rounded).value();
    ASSERT_TRUE(base.add(n, view));
    wanted.merge(triangles_of(view));
  }
  for (uint64_t n = 0; n < base.parts(); ++n) {
    const auto held = geometry::decode_chunk(base.part(n).mesh).value();
    EXPECT_LE(held.view.triangles(), wire::kBasePart);
    told.merge(triangles_of(held.view));
  }
  EXPECT_EQ(base.triangles(), 20'000u);
  EXPECT_GT(base.parts(), 4u);
  EXPECT_TRUE(told == wanted);
}

geometry::ChunkBytes scalars() {
  return test::chunk_of({{{0, 0, 0}, {0, 0, 1}, std::bit_cast<uint32_t>(0.0f)},
                         {{1, 0, 0}, {0, 0, 1}, std::bit_cast<uint32_t>(0.5f)},
                         {{0, 1, 0}, {0, 0, 1}, std::bit_cast<uint32_t>(1.0f)}},
                        {0, 1, 2}, true);
}

TEST(Base, ColoursScalars) {
  scene::Colouring colouring;
  colouring.map = *colour::find_colour_map("viridis");
  const scene::ColourTable table = scene::make_table(colouring);
  geometry::HeldChunk chunk;
  Base base({leaf(0, 1)}, 1, &table);
  ASSERT_TRUE(base.add(0, view_of(scalars(), chunk)));
  const auto held = geometry::decode_chunk(base.part(0).mesh).value();
  EXPECT_FALSE(held.view.scalars);
  std::map<float, uint32_t> colours;  // by x + 2 y
  for (size_t v = 0; v < 3; ++v)
    colours[held.view.positions_room[3 * v] + 2 * held.view.positions_room[3 * v + 1]] = held.view.colours[v];
  EXPECT_EQ(colours, (std::map<float, uint32_t>{{0, table.at(0)}, {1, table.at(0.5f)}, {2, table.at(1)}}));
}

TEST(Base, RefusesChunksThatAreNotWhatTheListSays) {
  geometry::HeldChunk chunk;
  const auto triangle =
      test::chunk_of({{{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}}}, {0, 1, 2});
  EXPECT_TRUE(Base({leaf(0, 1)}, 1, nullptr).add(0, view_of(triangle, chunk)));
  EXPECT_FALSE(Base({leaf(0, 2)}, 1, nullptr).add(0, view_of(triangle, chunk)));
  EXPECT_FALSE(Base({leaf(0, 1)}, 1, nullptr).add(0, view_of(scalars(), chunk)));
}

TEST(Base, HoldsTheNodesThatWereAskedForLast) {
  geometry::HeldChunk chunk;
  const auto view = view_of(
      test::chunk_of({{{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}}}, {0, 1, 2}), chunk);
  Base base({leaf(0, 1), leaf(1, 1), leaf(2, 1)}, 1, nullptr);
  for (uint32_t n = 0; n < 3; ++n) ASSERT_TRUE(base.add(n, view));
  (void)base.part(0);
  base.keep_within(2);
  EXPECT_TRUE(base.has(0));
  EXPECT_FALSE(base.has(1));
  EXPECT_TRUE(base.has(2));
  EXPECT_EQ(base.triangles(), 2u);
}

// A base of a square of 0.8 m at depth z that faces +z, in triangles of 2 cm, and a node that nothing is known of.
constexpr float kSide = 0.02f;
Base square(float z, float error_m = 1e-4f) {
  std::vector<test::Vertex> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i <= 40; ++i)
    for (uint32_t k = 0; k <= 40; ++k) {
      vertices.push_back({{kSide * (float(i) - 20), kSide * (float(k) - 20), z}, {0, 0, 1}});
      const uint32_t at = 41 * i + k;
      if (i < 40 && k < 40) indices.insert(indices.end(), {at, at + 1, at + 41, at + 1, at + 42, at + 41});
    }
  auto above = leaf(1, 3200);
  if (error_m > 0) above.spacing_m = error_m, above.children = 1;
  auto behind = leaf(2, 1);
  behind.box_room = {glm::vec3(0, 0, 9), glm::vec3(1, 1, 9)};
  Base out({leaf(0, 0), above, behind}, 1, nullptr);
  geometry::HeldChunk held;
  EXPECT_TRUE(out.add(1, view_of(test::chunk_of(vertices, indices), held)));
  return out;
}
// The x of each triangle's middle, by its number.
std::vector<float> places(Base& base) {
  std::vector<float> out;
  const auto held = geometry::decode_chunk(base.part(0).mesh).value();
  for (size_t t = 0; t < held.view.triangles(); ++t) {
    float x = 0;
    for (size_t k = 0; k < 3; ++k) x += held.view.positions_room[3 * size_t{held.view.indices[3 * t + k]}] / 3;
    out.push_back(x);
  }
  return out;
}

std::set<uint32_t> hidden(const Base& base) {
  std::set<uint32_t> out;
  const auto words = base.hidden();
  for (size_t i = 0; i < words.size(); i += 3)
    for (uint64_t bits = words[i + 1] | uint64_t{words[i + 2]} << 32; bits != 0; bits &= bits - 1)
      out.insert(64 * words[i] + uint32_t(std::countr_zero(bits)));
  return out;
}

// A view from z = 1 along -z, in which each pixel's ray ends at this depth; 0: it meets nothing.
SampledTile seen(const std::function<double(double x, double y)>& depth_m) {
  SampledTile tile;
  tile.camera = geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 60, 256, 256);
  tile.rect = {0, 0, 256, 256};
  tile.image = image::DepthImage(256, 256);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      const glm::dvec3 p = tile.camera.unproject(x + 0.5, y + 0.5, 1);
      if (const double d = depth_m(p.x, p.y); d > 0)
        tile.image.depth[size_t(256 * y + x)] = image::encode_depth(d, tile.camera.near_m);
    }
  return tile;
}
const auto kNothing = [](double, double) { return 0.0; };

TEST(Base, RaysThatMeetNothingHideTriangles) {
  Base base = square(0);
  base.hide(seen(kNothing), nullptr);
  EXPECT_EQ(hidden(base).size(), base.triangles());
}

TEST(Base, RaysThatEndOnASurfaceHideNothing) {
  Base base = square(0);
  base.hide(seen([](double, double) { return 1.0; }), nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, TrianglesBehindASurfaceStay) {
  Base base = square(-0.2f);
  base.hide(seen([](double, double) { return 1.0; }), nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, RaysThatEndWithinItsErrorHideNothing) {
  Base rough = square(0, 0.1f), exact = square(0);
  const auto behind = seen([](double, double) { return 1.08; });
  rough.hide(behind, nullptr);
  exact.hide(behind, nullptr);
  EXPECT_TRUE(rough.hidden().empty());
  EXPECT_EQ(hidden(exact).size(), exact.triangles());
}

TEST(Base, TrianglesOfTheMeshItselfStay) {
  Base base = square(0, 0);
  base.hide(seen(kNothing), nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, TrianglesAtTheEdgeOfASurfaceAreHidden) {
  Base base = square(0);
  // The surface ends at x = 0.1.
  base.hide(seen([](double x, double) { return x < 0.1 ? 1.0 : 0.0; }), nullptr);
  const auto gone = hidden(base);
  const auto at = places(base);
  for (uint32_t i = 0; i < at.size(); ++i) {
    if (at[i] > 0.1f + kSide) EXPECT_TRUE(gone.contains(i)) << at[i];
    if (at[i] < 0.1f - kSide) EXPECT_FALSE(gone.contains(i)) << at[i];
  }
}

TEST(Base, RaysThatWereNotCastTellNothing) {
  Base base = square(0);
  image::PixelMask cast;
  cast.reset(256, 256);
  base.hide(seen(kNothing), &cast);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, RaysCoarserThanItsTrianglesTellNothing) {
  Base base = square(0);
  SampledTile far = seen(kNothing);
  far.camera = geometry::make_camera({{0, 0, 9}, {1, 0, 0, 0}}, 60, 256, 256);
  base.hide(far, nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, ShowsTheTrianglesOfABoxAgain) {
  Base base = square(0);
  base.hide(seen(kNothing), nullptr);
  (void)base.take_changes();
  base.show({glm::vec3(0, -1, -1), glm::vec3(1, 1, 1)});
  const auto gone = hidden(base);
  const auto at = places(base);
  for (uint32_t i = 0; i < at.size(); ++i) EXPECT_EQ(gone.contains(i), at[i] < 0);
  EXPECT_FALSE(base.take_changes().empty());
  EXPECT_TRUE(base.take_changes().empty());
}

TEST(Base, HoldsTheNodesThatTilesShow) {
  Base base = square(0);
  geometry::HeldChunk held;
  ASSERT_TRUE(base.add(
      2, view_of(test::triangle({{0, 0, 9}, {0, 0, 1}}, {{1, 0, 9}, {0, 0, 1}}, {{0, 1, 9}, {0, 0, 1}}), held)));
  base.hide(seen(kNothing), nullptr);
  base.keep_within(3200);
  EXPECT_TRUE(base.has(1));
  EXPECT_FALSE(base.has(2)) << "it lies behind the eye";
}

TEST(Base, ForgetsWhatIsHiddenOfANodeThatGoes) {
  Base base = square(0);
  base.hide(seen(kNothing), nullptr);
  (void)base.take_changes();
  geometry::HeldChunk held;
  ASSERT_TRUE(base.add(
      2, view_of(test::triangle({{0, 0, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}}, {{0, 1, 0}, {0, 0, 1}}), held)));
  base.keep_within(1);
  ASSERT_FALSE(base.has(1));
  EXPECT_TRUE(hidden(base).empty());
  EXPECT_FALSE(base.take_changes().empty()) << "viewers learn of it";
}

}  // namespace
}  // namespace telesplat::packer
