#include "services/data/mesh/levels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/image/normal.h"

namespace telesplat::data {
namespace {

using geometry::MeshChunkView;

constexpr uint32_t kNoNumber = ~uint32_t{0};
// Triangles that meet a cell are drawn if they have at least this part of its surface; else its surface is thin.
constexpr float kLeastDrawn = 0.25f;

uint64_t mixed(uint64_t key) { return (key * 0x9e3779b97f4a7c15ull) >> 20; }

// Numbers keys in the order of their first use: open addressing, at most half full.
class KeyTable {
 public:
  explicit KeyTable(size_t expected) : slots_(std::bit_ceil(2 * expected + 16)) { keys_.reserve(expected); }
  /// Returns the number of a key; kNoNumber: it is not there.
  uint32_t find(uint64_t key) const {
    const uint32_t slot = slots_[place(key)];
    return slot == 0 ? kNoNumber : slot - 1;
  }
  /// The same, adding it if it is not there.
  uint32_t add(uint64_t key) {
    size_t at = place(key);
    if (slots_[at] != 0) return slots_[at] - 1;
    if (2 * keys_.size() >= slots_.size()) {
      std::vector<uint32_t>(2 * slots_.size()).swap(slots_);
      for (size_t i = 0; i < keys_.size(); ++i) slots_[place(keys_[i])] = static_cast<uint32_t>(i + 1);
      at = place(key);
    }
    keys_.push_back(key);
    slots_[at] = static_cast<uint32_t>(keys_.size());
    return slots_[at] - 1;
  }
  size_t size() const { return keys_.size(); }

 private:
  size_t place(uint64_t key) const {
    size_t at = mixed(key) & (slots_.size() - 1);
    while (slots_[at] != 0 && keys_[slots_[at] - 1] != key) at = (at + 1) & (slots_.size() - 1);
    return at;
  }
  std::vector<uint32_t> slots_;  // number + 1; 0: free
  std::vector<uint64_t> keys_;
};

constexpr int kAxisBits = 21;  // bits of a cell's place along an axis

// A grid of cells over the whole mesh.
struct ClusterGrid {
  glm::vec3 origin;
  float cell_m;
  static constexpr float kMostCells = (1 << kAxisBits) - 1;

  uint64_t key(const glm::vec3& p) const {
    const glm::vec3 at = glm::clamp((p - origin) / cell_m, glm::vec3(0), glm::vec3(kMostCells));
    return static_cast<uint64_t>(at.x) | static_cast<uint64_t>(at.y) << kAxisBits |
           static_cast<uint64_t>(at.z) << 2 * kAxisBits;
  }
};

glm::vec3 place_of(const MeshChunkView& chunk, uint32_t v) {
  const float* p = &chunk.positions_room[3 * size_t{v}];
  return {p[0], p[1], p[2]};
}

// Sums over the surface in a cell, weighted by area.
struct ClusterCell {
  glm::vec3 position{0};
  float area_m2 = 0, drawn_m2 = 0;
  uint32_t first = kNoNumber;  // its first direction
};
// Likewise over the part of it that faces about one way: a vertex of the node.
struct ClusterFace {
  glm::vec3 facing;                // the first normal
  glm::vec3 normal{0}, colour{0};  // colour.x: the scalar, colour.y: the weight of finite scalars
  float area_m2 = 0;
  uint32_t cell = 0, next = kNoNumber;  // the next direction of the same cell
  uint32_t vertex = kNoNumber;          // number in the node, once a triangle uses it
};

class Clustering {
 public:
  Clustering(const ClusterGrid& grid, size_t cells) : grid_(grid), keys_(cells) {}

  void add(const MeshChunkView& chunk);
  /// Counts the cells so far as the node's own.
  void end_own() { own_ = cells_.size(); }
  /// Adds the triangles of a chunk beyond the border that have a corner in one of the own cells.
  void add_around(const MeshChunkView& chunk, const geometry::Box& reach);
  /// Returns the mesh of the cells.
  std::vector<std::byte> build();

 private:
  using Triangle = std::array<uint32_t, 3>;  // directions

  uint32_t direction_of(uint32_t cell, const glm::vec3& normal);
  uint32_t corner(const MeshChunkView& chunk, uint32_t v);
  void add(const MeshChunkView& chunk, const uint32_t* corners);
  uint32_t vertex(uint32_t direction, const glm::vec3& at);
  glm::vec3 mean(uint32_t cell) const { return cells_[cell].position / cells_[cell].area_m2; }
  void draw(const Triangle& triangle);
  void draw_thin(const ClusterCell& cell, const glm::vec3& at);

  const ClusterGrid grid_;
  KeyTable keys_;
  size_t own_ = 0;
  std::vector<ClusterCell> cells_;
  std::vector<ClusterFace> directions_;
  std::vector<Triangle> triangles_;
  std::vector<uint32_t> of_vertex_;  // directions of the vertices of the chunk at hand; kNoNumber: not known
  bool scalars_ = false;

  std::vector<float> positions_;
  std::vector<uint32_t> normals_, colours_, indices_;
};

uint32_t Clustering::direction_of(uint32_t cell, const glm::vec3& normal) {
  constexpr int kDirections = 3;
  uint32_t* next = &cells_[cell].first;
  uint32_t last = kNoNumber;
  for (int n = 0; *next != kNoNumber; ++n) {
    last = *next;
    if (glm::dot(directions_[last].facing, normal) > 0.5f || n + 1 == kDirections) return last;
    next = &directions_[last].next;
  }
  const auto fresh = static_cast<uint32_t>(directions_.size());
  *next = fresh;
  directions_.push_back({.facing = normal, .cell = cell});
  return fresh;
}

uint32_t Clustering::corner(const MeshChunkView& chunk, uint32_t v) {
  if (of_vertex_[v] != kNoNumber) return of_vertex_[v];
  const uint32_t cell = keys_.add(grid_.key(place_of(chunk, v)));
  if (cell == cells_.size()) cells_.emplace_back();
  return of_vertex_[v] = direction_of(cell, image::decode_normal32(chunk.normals[v]));
}

void Clustering::add(const MeshChunkView& chunk, const uint32_t* corners) {
  const glm::vec3 p[3] = {place_of(chunk, corners[0]), place_of(chunk, corners[1]), place_of(chunk, corners[2])};
  const float area = glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) / 6;  // a corner has a third
  if (!(area > 0)) return;
  Triangle triangle;
  for (size_t k = 0; k < 3; ++k) {
    const uint32_t v = corners[k], c = chunk.colours[v];
    triangle[k] = corner(chunk, v);
    ClusterFace& to = directions_[triangle[k]];
    ClusterCell& cell = cells_[to.cell];
    cell.position += area * (p[k] - grid_.origin), cell.area_m2 += area;
    to.normal += area * image::decode_normal32(chunk.normals[v]), to.area_m2 += area;
    if (!chunk.scalars)
      to.colour += area * glm::vec3(float(c >> 16 & 255), float(c >> 8 & 255), float(c & 255));
    else if (const float scalar = std::bit_cast<float>(c); std::isfinite(scalar))
      to.colour += area * glm::vec3(scalar, 1, 0);
  }
  triangles_.push_back(triangle);
}

void Clustering::add(const MeshChunkView& chunk) {
  scalars_ = chunk.scalars;
  of_vertex_.assign(chunk.vertices(), kNoNumber);
  for (size_t i = 0; i < chunk.indices.size(); i += 3) add(chunk, &chunk.indices[i]);
}

void Clustering::add_around(const MeshChunkView& chunk, const geometry::Box& reach) {
  of_vertex_.assign(chunk.vertices(), kNoNumber);
  std::vector<int8_t> meets(chunk.vertices(), -1);  // 1: its cell is an own one; -1: not known
  for (uint32_t v = 0; v < chunk.vertices(); ++v) {
    const glm::vec3 p = place_of(chunk, v);
    const bool near = glm::all(glm::lessThanEqual(reach.lo, p)) && glm::all(glm::lessThanEqual(p, reach.hi));
    const uint32_t cell = near ? keys_.find(grid_.key(p)) : kNoNumber;
    meets[v] = cell != kNoNumber && cell < own_;
  }
  for (size_t i = 0; i < chunk.indices.size(); i += 3) {
    const uint32_t* c = &chunk.indices[i];
    if (meets[c[0]] == 1 || meets[c[1]] == 1 || meets[c[2]] == 1) add(chunk, c);
  }
}

uint32_t Clustering::vertex(uint32_t direction, const glm::vec3& at) {
  const ClusterFace& d = directions_[direction];
  const auto number = static_cast<uint32_t>(normals_.size());
  positions_.insert(positions_.end(), {at.x, at.y, at.z});
  const float length = glm::length(d.normal);
  normals_.push_back(image::encode_normal32(length > 0 ? d.normal / length : d.facing));
  if (scalars_) {
    const float none = std::numeric_limits<float>::quiet_NaN();
    colours_.push_back(std::bit_cast<uint32_t>(d.colour.y > 0 ? d.colour.x / d.colour.y : none));
  } else {
    const glm::vec3 c = d.colour / d.area_m2 + 0.5f;
    colours_.push_back(static_cast<uint32_t>(c.x) << 16 | static_cast<uint32_t>(c.y) << 8 | static_cast<uint32_t>(c.z));
  }
  return number;
}

void Clustering::draw(const Triangle& triangle) {
  glm::vec3 at[3];
  for (size_t k = 0; k < 3; ++k) {
    ClusterFace& d = directions_[triangle[k]];
    at[k] = mean(d.cell);
    if (d.vertex == kNoNumber) d.vertex = vertex(triangle[k], grid_.origin + at[k]);
    indices_.push_back(d.vertex);
  }
  const float third = glm::length(glm::cross(at[1] - at[0], at[2] - at[0])) / 6;
  for (const uint32_t corner : triangle) cells_[directions_[corner].cell].drawn_m2 += third;
}

// Draws a triangle of equal sides around the cell's mean for each of its directions.
void Clustering::draw_thin(const ClusterCell& cell, const glm::vec3& at) {
  const float most = grid_.cell_m * grid_.cell_m;
  for (uint32_t i = cell.first; i != kNoNumber; i = directions_[i].next) {
    const float area = std::min(0.5f * directions_[i].area_m2, most);
    if (area < 1e-3f * most) continue;
    const glm::vec3 n = glm::normalize(directions_[i].facing);
    const glm::vec3 aside = std::abs(n.x) < 0.7f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
    const float radius = std::sqrt(area * 0.7698f);  // the circle through its corners: area = 3 sqrt(3) / 4 r^2
    const glm::vec3 u = radius * glm::normalize(glm::cross(n, aside)), v = glm::cross(n, u);
    for (const glm::vec3& corner : {u, -0.5f * u + 0.8660254f * v, -0.5f * u - 0.8660254f * v})
      indices_.push_back(vertex(i, at + corner));
  }
}

std::vector<std::byte> Clustering::build() {
  KeyTable drawn(triangles_.size() / 4);
  for (const Triangle& t : triangles_) {
    const uint32_t cells[3] = {directions_[t[0]].cell, directions_[t[1]].cell, directions_[t[2]].cell};
    if (cells[0] == cells[1] || cells[1] == cells[2] || cells[2] == cells[0]) continue;
    Triangle key = t;
    std::sort(key.begin(), key.end());
    const size_t before = drawn.size();
    if (drawn.add(uint64_t{key[0]} | uint64_t{key[1]} << 21 | uint64_t{key[2]} << 42) == before) draw(t);
  }
  for (size_t i = 0; i < own_; ++i)
    if (cells_[i].drawn_m2 < kLeastDrawn * cells_[i].area_m2)
      draw_thin(cells_[i], grid_.origin + mean(static_cast<uint32_t>(i)));
  if (indices_.empty()) return {};
  return geometry::build_chunk(positions_, normals_, colours_, indices_, scalars_);
}

geometry::Box grown(const geometry::Box& box, float by_m) { return {box.lo - by_m, box.hi + by_m}; }

bool meet(const geometry::Box& a, const geometry::Box& b) {
  return glm::all(glm::lessThanEqual(a.lo, b.hi)) && glm::all(glm::lessThanEqual(b.lo, a.hi));
}

// The chunks that a node replaces.
struct Replaced {
  std::vector<geometry::HeldChunk> chunks;
  geometry::Box box_room, whole_room;  // theirs, and that of the whole mesh
  size_t triangles = 0;
  float spacing_m = 0;  // the largest

  double area_m2() const {
    double area = 0;
    for (const auto& [chunk, owner] : chunks)
      for (size_t i = 0; i < chunk.indices.size(); i += 3) {
        const glm::vec3 a = place_of(chunk, chunk.indices[i]);
        area += 0.5 * double{glm::length(glm::cross(place_of(chunk, chunk.indices[i + 1]) - a,
                                                    place_of(chunk, chunk.indices[i + 2]) - a))};
      }
    return area;
  }
  size_t cells(float cell_m, size_t expected) const {
    const ClusterGrid grid{whole_room.lo, cell_m};
    KeyTable keys(expected);
    for (const auto& [chunk, owner] : chunks)
      for (uint32_t v = 0; v < chunk.vertices(); ++v) keys.add(grid.key(place_of(chunk, v)));
    return keys.size();
  }
};

Replaced replaced_by(const LevelBelow& below, size_t first, size_t last) {
  Replaced out;
  for (const geometry::Box& box : below.boxes_room) out.whole_room.extend(box);
  for (size_t i = first; i < last; ++i) {
    out.chunks.push_back(below.chunk(i));
    out.box_room.extend(below.boxes_room[i]);
    out.triangles += out.chunks.back().view.triangles();
    out.spacing_m = std::max(out.spacing_m, below.spacings_m[i]);
  }
  return out;
}

// Searches for the size of cells that gives about as many triangles: a surface has twice as many as cells.
float find_cluster_size(const Replaced& replaced, size_t triangles) {
  const double wanted = std::max(1.0, 0.5 * static_cast<double>(triangles));
  const glm::vec3 size = replaced.whole_room.size();
  const double largest = double{std::max({size.x, size.y, size.z})};
  const double least = std::max(1.3 * double{replaced.spacing_m}, largest / 1e6);
  double cell = std::clamp(std::sqrt(1.5 * replaced.area_m2() / wanted), least, std::max(least, largest));
  for (int n = 0; n < 5; ++n) {
    const double ratio = static_cast<double>(replaced.cells(static_cast<float>(cell), size_t(wanted))) / wanted;
    if (ratio > 0.8 && ratio < 1.1) break;
    cell = std::clamp(cell * std::clamp(std::sqrt(ratio), 0.25, 4.0), least, std::max(least, largest));
  }
  return static_cast<float>(cell);
}

}  // namespace

CoarseNode make_coarse_node(const LevelBelow& below, size_t first, size_t last, size_t most) {
  CHECK(first < last && most >= 1);
  const Replaced replaced = replaced_by(below, first, last);
  const size_t wanted = std::clamp<size_t>(replaced.triangles / kChildren, 1, most);
  CoarseNode out{{}, find_cluster_size(replaced, wanted)};
  // Triangles that are larger than the cells stay as they are: then the cells must be larger.
  for (int n = 0; n < 12; ++n, out.spacing_m *= 1.5f) {
    Clustering clustering({replaced.whole_room.lo, out.spacing_m}, wanted);
    for (const auto& chunk : replaced.chunks) clustering.add(chunk.view);
    clustering.end_own();
    const geometry::Box reach = grown(replaced.box_room, out.spacing_m);
    for (size_t i = 0; i < below.boxes_room.size(); ++i)
      if ((i < first || i >= last) && meet(below.boxes_room[i], reach))
        clustering.add_around(below.chunk(i).view, reach);
    out.chunk = clustering.build();
    if (out.chunk.empty()) return out;
    const size_t triangles = MeshChunkView::validate(out.chunk)->triangles();
    if (triangles <= 2 * most && triangles < replaced.triangles) return out;
  }
  return {};
}

}  // namespace telesplat::data
