// Chunks of any mesh hold each of its triangles exactly once, in compact parts.
#include <algorithm>
#include <map>

#include "common/geometry/mesh_chunk.h"
#include "services/data/mesh/store_file.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

// Triangles anywhere, large and small, sharing vertices at random, with duplicates, slivers and degenerate ones.
Mesh random_mesh(std::mt19937& random) {
  const auto pick = [&](uint32_t below) { return std::uniform_int_distribution<uint32_t>(0, below - 1)(random); };
  Mesh mesh;
  const uint32_t vertices = 3 + pick(400), triangles = 1 + pick(2000);
  const double scale = std::pow(10.0, static_cast<int>(pick(13)) - 6), offset = pick(2) ? 1e6 * scale : 0.0;
  const int shape = static_cast<int>(pick(4));
  for (uint32_t i = 0; i < vertices; ++i) {
    const auto real = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    glm::dvec3 p(real(), shape == 1 ? 0.0 : real(), shape == 2 ? 0.01 * real() : real());
    if (shape == 3) p = glm::dvec3(pick(4), pick(4), pick(4));  // many at one place
    mesh.positions.push_back(p * scale + offset);
    mesh.colours.push_back(i);  // a different colour for each vertex
  }
  for (uint32_t i = 0; i < 3 * triangles; ++i) mesh.indices.push_back(pick(vertices));
  mesh.indices.insert(mesh.indices.end(), {0, 1, 2});
  return mesh;
}

// A triangle's corners by colour, starting with the least, orientation kept: the same for any rotation.
std::array<uint32_t, 3> key_of(std::array<uint32_t, 3> corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

TEST(Chunks, HoldEveryTriangleOnceForRandomMeshes) {
  std::mt19937 random(20240);
  int opened = 0;
  for (int round = 0; round < 200; ++round) {
    const Mesh mesh = random_mesh(random);
    const auto placed = place_mesh(Mesh(mesh), {.up = "y", .crease_deg = 180}, "random");
    if (!placed) {  // all triangles degenerate, or no extent: it reports an error
      EXPECT_TRUE(placed.error().text.starts_with("random: ")) << placed.error().text;
      continue;
    }
    ++opened;
    EXPECT_EQ(placed->indices.size() / 3 + placed->degenerate_dropped, mesh.indices.size() / 3);
    std::map<std::array<uint32_t, 3>, int> count;
    double area = 0, chunk_area = 0;
    const auto area_of = [](glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
      return 0.5 * glm::length(glm::cross(b - a, c - a));
    };
    for (size_t t = 0; t < placed->indices.size(); t += 3) {
      const uint32_t* v = &placed->indices[t];
      ++count[key_of({placed->colours[v[0]], placed->colours[v[1]], placed->colours[v[2]]})];
      area += area_of(placed->positions_room[v[0]], placed->positions_room[v[1]], placed->positions_room[v[2]]);
    }
    const size_t most = 1 + static_cast<size_t>(round) * 3;
    const ChunkPlan plan = plan_chunks(*placed, most);
    std::vector<uint32_t> all = plan.order;
    std::sort(all.begin(), all.end());
    for (size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i], i);
    ASSERT_EQ(all.size(), placed->indices.size() / 3);
    geometry::Box whole;
    for (size_t c = 0; c < plan.chunks(); ++c) {
      const size_t size = plan.begin[c + 1] - plan.begin[c];
      EXPECT_GE(size, 1u);
      EXPECT_LE(size, most);
      EXPECT_TRUE(plan.chunks() == 1 || 2 * size + 2 >= most) << size;
      const auto bytes = make_chunk(*placed, std::span(plan.order).subspan(plan.begin[c], size));
      const auto view = geometry::MeshChunkView::validate(bytes);
      ASSERT_TRUE(view.ok()) << view.error().text;
      ASSERT_EQ(view->triangles(), size);
      std::vector<bool> used(view->vertices(), false);
      geometry::Box box;
      for (size_t t = 0; t < size; ++t) {
        const uint32_t* v = &view->indices[3 * t];
        --count[key_of({view->colours[v[0]], view->colours[v[1]], view->colours[v[2]]})];
        glm::vec3 p[3];
        for (int k = 0; k < 3; ++k) {
          used[v[k]] = true;
          p[k] = {view->positions_room[3 * v[k]], view->positions_room[3 * v[k] + 1],
                  view->positions_room[3 * v[k] + 2]};
          EXPECT_EQ(p[k], placed->positions_room[view->colours[v[k]]]);
          EXPECT_EQ(view->normals[v[k]], placed->normals[view->colours[v[k]]]);
          box.extend(p[k]);
        }
        chunk_area += area_of(p[0], p[1], p[2]);
      }
      EXPECT_TRUE(std::all_of(used.begin(), used.end(), [](bool b) { return b; })) << "a vertex that no triangle uses";
      EXPECT_EQ(box, view->box_room);
      whole.extend(box);
    }
    for (const auto& [key, n] : count) EXPECT_EQ(n, 0);
    EXPECT_NEAR(chunk_area, area, 1e-9 * area);
    EXPECT_EQ(whole, placed->box_room);
    for (uint32_t n : placed->normals) EXPECT_NEAR(glm::length(image::decode_normal32(n)), 1.0f, 1e-5f);
  }
  EXPECT_GT(opened, 150);
}

// On an even grid a chunk's box is about as large as its share of the area: far from the strips or scatter of a bad
// order.
TEST(Chunks, AreCompact) {
  const auto placed = place_mesh(wavy_grid(256, 0.0), {.room_size_m = 1, .up = "z"}, "grid");
  ASSERT_TRUE(placed.ok());
  const ChunkPlan plan = plan_chunks(*placed, 2048);
  ASSERT_EQ(plan.chunks(), 64u);
  for (size_t c = 0; c < plan.chunks(); ++c) {
    const auto bytes =
        make_chunk(*placed, std::span(plan.order).subspan(plan.begin[c], plan.begin[c + 1] - plan.begin[c]));
    const glm::vec3 size = geometry::MeshChunkView::validate(bytes)->box_room.size();
    EXPECT_LT(size.x * size.z, 1.25f / 64);
    EXPECT_LT(std::max(size.x, size.z), 2.2f * std::min(size.x, size.z));
  }
}

TEST(Chunks, DoNotDependOnThreads) {
  std::mt19937 random(7);
  const Mesh mesh = random_mesh(random);
  const auto a = place_mesh(Mesh(mesh), {.up = "y"}, "a"), b = place_mesh(Mesh(mesh), {.up = "y"}, "b");
  EXPECT_EQ(plan_chunks(*a, 100).order, plan_chunks(*b, 100).order);
  const auto plan = plan_chunks(*a, 100);
  const auto first = std::span(plan.order).first(plan.begin[1]);
  EXPECT_EQ(make_chunk(*a, first), make_chunk(*b, first));
}

}  // namespace
}  // namespace telesplat::data::test
