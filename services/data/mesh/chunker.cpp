#include "services/data/mesh/store_file.h"

#include <algorithm>
#include <bit>

#include "common/geometry/mesh_chunk.h"
#include "common/parallel/in_parallel.h"
#include "services/data/base/numbering.h"

namespace telesplat::data {
namespace {

using geometry::Box;

// A triangle by its centroid (times three).
struct Item {
  glm::vec3 centroid;
  uint32_t triangle;
};

Item item_of(const PlacedMesh& mesh, uint32_t triangle) {
  const uint32_t* t = &mesh.indices[3 * size_t{triangle}];
  return {mesh.positions_room[t[0]] + mesh.positions_room[t[1]] + mesh.positions_room[t[2]], triangle};
}

Box box_of(std::span<const Item> items) {
  Box box;
  for (const Item& item : items) box.extend(item.centroid);
  return box;
}

// Splits items[0..] recursively into `parts` parts of equal size (to one triangle); `starts` receives the first
// index of each part. Four parts that follow each other, counted from the first, are close together: levels.h.
void split(std::span<Item> items, size_t first, size_t parts, std::span<size_t> starts) {
  if (parts == 1) {
    starts[0] = first;
    return;
  }
  const glm::vec3 size = box_of(items).size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const size_t left_parts = std::bit_floor(parts - 1), middle = items.size() * left_parts / parts;
  // Ties are broken by number, so that the result depends on the mesh alone.
  std::nth_element(items.begin(), items.begin() + middle, items.end(), [axis](const Item& a, const Item& b) {
    return a.centroid[axis] != b.centroid[axis] ? a.centroid[axis] < b.centroid[axis] : a.triangle < b.triangle;
  });
  both_in_parallel(
      [&] { split(items.first(middle), first, left_parts, starts.first(left_parts)); },
      [&] { split(items.subspan(middle), first + middle, parts - left_parts, starts.subspan(left_parts)); });
}

// Spreads the lower 10 bits, with two zeros between them.
uint32_t spread(uint32_t v) {
  v = (v | v << 16) & 0x030000ff;
  v = (v | v << 8) & 0x0300f00f;
  v = (v | v << 4) & 0x030c30c3;
  return (v | v << 2) & 0x09249249;
}

// Returns the triangles in the order of a Morton curve.
std::vector<uint32_t> morton_order(const PlacedMesh& mesh, std::span<const uint32_t> triangles) {
  Box box;
  for (uint32_t t : triangles) box.extend(item_of(mesh, t).centroid);
  const glm::vec3 size = box.size();
  const float scale = 1023.0f / std::max({size.x, size.y, size.z, 1e-30f});
  std::vector<uint64_t> keys;
  keys.reserve(triangles.size());
  for (uint32_t t : triangles) {
    const glm::vec3 cell = glm::min((item_of(mesh, t).centroid - box.lo) * scale, glm::vec3(1023.0f));
    const uint32_t code = spread(static_cast<uint32_t>(cell.x)) | spread(static_cast<uint32_t>(cell.y)) << 1 |
                          spread(static_cast<uint32_t>(cell.z)) << 2;
    keys.push_back(uint64_t{code} << 32 | t);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> order(keys.size());
  std::transform(keys.begin(), keys.end(), order.begin(), [](uint64_t key) { return static_cast<uint32_t>(key); });
  return order;
}

// A vertex of the whole mesh in one of its colours: it has several where faces are coloured.
struct Corner {
  uint32_t vertex, colour;
};

}  // namespace

ChunkPlan plan_chunks(const PlacedMesh& mesh, size_t most) {
  CHECK(most >= 1);
  return plan_chunk_count(mesh, (mesh.indices.size() / 3 + most - 1) / most);
}

ChunkPlan plan_chunk_count(const PlacedMesh& mesh, size_t chunks) {
  const size_t triangles = mesh.indices.size() / 3;
  CHECK(chunks >= 1 && chunks <= triangles);
  std::vector<Item> items(triangles);
  in_parallel(tbb::blocked_range<size_t>(0, triangles, 1 << 16), [&](const auto& range) {
    for (size_t t = range.begin(); t < range.end(); ++t) items[t] = item_of(mesh, static_cast<uint32_t>(t));
  });
  ChunkPlan plan;
  plan.begin.resize(chunks + 1);
  split(items, 0, chunks, std::span(plan.begin).first(chunks));
  plan.begin[chunks] = triangles;
  plan.order.resize(triangles);
  for (size_t i = 0; i < triangles; ++i) plan.order[i] = items[i].triangle;
  return plan;
}

std::vector<std::byte> make_chunk(const PlacedMesh& mesh, std::span<const uint32_t> triangles) {
  Numbering<Corner> number(3 * triangles.size());
  std::vector<uint32_t> indices;
  indices.reserve(3 * triangles.size());
  for (uint32_t t : morton_order(mesh, triangles))
    for (int k = 0; k < 3; ++k) {
      const uint32_t vertex = mesh.indices[3 * size_t{t} + k];
      indices.push_back(number({vertex, mesh.face_colours.empty() ? mesh.colours[vertex] : mesh.face_colours[t]}));
    }
  const std::vector<Corner>& used = number.keys();
  std::vector<float> positions;
  positions.reserve(3 * used.size());
  std::vector<uint32_t> normals, colours;
  normals.reserve(used.size());
  colours.reserve(used.size());
  for (const Corner& corner : used) {
    const glm::vec3& p = mesh.positions_room[corner.vertex];
    positions.insert(positions.end(), {p.x, p.y, p.z});
    normals.push_back(mesh.normals[corner.vertex]);
    colours.push_back(corner.colour);
  }
  return geometry::build_chunk(positions, normals, colours, indices, mesh.scalars);
}

}  // namespace telesplat::data
