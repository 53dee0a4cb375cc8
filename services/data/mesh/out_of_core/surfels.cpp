#include "services/data/mesh/out_of_core/surfels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "common/image/normal.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::data {
namespace {

using geometry::MeshChunkView;

// Samples of a triangle lie at most this part of a cell apart.
constexpr float kSampleStep = 0.8f;
constexpr double kMostCells = (1 << 20) - 1;  // along an axis: 20 bits of a key

// Weighted sums over the surface in a cell, as far as it faces about one way.
struct Cell {
  glm::vec3 position{0}, normal{0}, colour{0};  // colour.x: the scalar, colour.y: the weight of finite scalars
  float weight = 0;
  uint32_t other = 0;  // number of the next one of the same cell of the grid + 1; 0: none
};

// Sums by cell of the grid and direction, in order of appearance: open addressing, at most half full.
class Cells {
 public:
  Cells() : slots_(1 << 16) {}
  /// Returns the sums for a normal in a cell of the grid: those whose mean differs by less than 60 degrees, or the last
  /// ones.
  Cell& at(uint64_t key, const glm::vec3& normal) {
    if (2 * keys_.size() >= slots_.size()) grow();
    uint32_t* next = &slots_[find(key)];
    if (*next == 0) {
      keys_.push_back(key);
      firsts_.push_back(add());
      *next = static_cast<uint32_t>(keys_.size());
      return cells_.back();
    }
    uint32_t at = firsts_[*next - 1];
    for (int n = 1;; ++n) {
      Cell& cell = cells_[at];
      const float along = glm::dot(cell.normal, normal);
      if (n == kDirections ||
          (along > 0 && 4 * along * along > glm::dot(cell.normal, cell.normal) * glm::dot(normal, normal)))
        return cell;
      if (cell.other == 0) {
        const uint32_t fresh = add();
        cells_[at].other = fresh + 1;
        return cells_[fresh];
      }
      at = cell.other - 1;
    }
  }
  const std::vector<Cell>& cells() const { return cells_; }
  std::vector<std::pair<uint64_t, const Cell*>> by_key() const {
    std::vector<std::pair<uint64_t, const Cell*>> out;
    for (size_t i = 0; i < keys_.size(); ++i)
      for (uint32_t at = firsts_[i] + 1; at != 0; at = cells_[at - 1].other)
        out.emplace_back(keys_[i], &cells_[at - 1]);
    return out;
  }

 private:
  size_t find(uint64_t key) const {
    size_t at = (key * 0x9e3779b97f4a7c15ull >> 20) & (slots_.size() - 1);
    while (slots_[at] != 0 && keys_[slots_[at] - 1] != key) at = (at + 1) & (slots_.size() - 1);
    return at;
  }
  uint32_t add() {
    cells_.emplace_back();
    return static_cast<uint32_t>(cells_.size() - 1);
  }
  void grow() {
    std::vector<uint32_t>(2 * slots_.size()).swap(slots_);
    for (size_t i = 0; i < keys_.size(); ++i) slots_[find(keys_[i])] = static_cast<uint32_t>(i + 1);
  }
  static constexpr int kDirections = 3;
  std::vector<uint32_t> slots_;   // number of the key + 1; 0: free
  std::vector<uint64_t> keys_;    // cells of the grid that the surface meets
  std::vector<uint32_t> firsts_;  // first sums of each
  std::vector<Cell> cells_;
};

struct SurfacePoint {
  glm::vec3 position, normal, colour;
};

class Grid {
 public:
  Grid(const glm::vec3& origin, double cell_m) : origin_(origin), cell_m_(static_cast<float>(cell_m)) {}

  void add(const MeshChunkView& chunk) {
    for (size_t t = 0; t < chunk.triangles(); ++t) {
      SurfacePoint c[3];
      for (size_t k = 0; k < 3; ++k) c[k] = point_of(chunk, chunk.indices[3 * t + k]);
      add(c, chunk.scalars);
    }
  }
  /// Adds what another grid of the same cells has gathered.
  void add(const Grid& other) {
    for (const auto& [key, cell] : other.cells_.by_key()) {
      Cell& own = cells_.at(key, cell->normal);
      own.position += cell->position, own.normal += cell->normal, own.colour += cell->colour;
      own.weight += cell->weight;
    }
  }
  const std::vector<Cell>& cells() const { return cells_.cells(); }

 private:
  static SurfacePoint point_of(const MeshChunkView& chunk, uint32_t v) {
    const float* p = &chunk.positions_room[3 * size_t{v}];
    const uint32_t c = chunk.colours[v];
    const glm::vec3 colour = chunk.scalars ? glm::vec3(std::bit_cast<float>(c), 1, 0)
                                           : glm::vec3(float(c >> 16 & 255), float(c >> 8 & 255), float(c & 255));
    return {{p[0], p[1], p[2]}, image::decode_normal32(chunk.normals[v]), colour};
  }
  int steps(float length_m) const {
    return std::max(1, static_cast<int>(std::ceil(length_m / (kSampleStep * cell_m_))));
  }

  // Samples the triangle evenly: `along` its length from the corner opposite its shortest edge, and `across` that edge.
  void add(SurfacePoint c[3], bool scalars) {
    const float edges[3] = {glm::distance(c[1].position, c[2].position), glm::distance(c[2].position, c[0].position),
                            glm::distance(c[0].position, c[1].position)};
    const auto apex = static_cast<size_t>(std::min_element(edges, edges + 3) - edges);
    std::rotate(c, c + apex, c + 3);
    const float area = 0.5f * glm::length(glm::cross(c[1].position - c[0].position, c[2].position - c[0].position));
    const int along = steps(*std::max_element(edges, edges + 3)), across = steps(edges[apex]);
    if (!(area > 0)) return;
    if (along == 1 && across == 1) return add_sample(c, {1 / 3.0f, 1 / 3.0f, 1 / 3.0f}, area, scalars);
    const float mean = area / (static_cast<float>(along) * static_cast<float>(across));
    for (int i = 0; i < along; ++i)
      for (int j = 0; j < across; ++j) {
        const float s = (static_cast<float>(i) + 0.5f) / static_cast<float>(along);
        const float t = (static_cast<float>(j) + 0.5f) / static_cast<float>(across);
        add_sample(c, {1 - s, s * (1 - t), s * t}, 2 * s * mean, scalars);  // the triangle widens with s
      }
  }
  void add_sample(const SurfacePoint c[3], const glm::vec3& at, float weight, bool scalars) {
    const auto mix = [&](glm::vec3 SurfacePoint::*m) { return at.x * c[0].*m + at.y * c[1].*m + at.z * c[2].*m; };
    const glm::vec3 position = mix(&SurfacePoint::position), normal = mix(&SurfacePoint::normal),
                    colour = mix(&SurfacePoint::colour);
    const glm::vec3 place = (position - origin_) / cell_m_;
    const auto along = [](float p) { return static_cast<uint64_t>(std::clamp(double(p), 0.0, kMostCells)); };
    Cell& cell = cells_.at(along(place.x) | along(place.y) << 20 | along(place.z) << 40, normal);
    cell.position += weight * (position - origin_);
    cell.normal += weight * normal;
    cell.weight += weight;
    if (!scalars || std::isfinite(colour.x)) cell.colour += weight * colour;
  }

  glm::vec3 origin_;
  float cell_m_;
  Cells cells_;
};

// Area of a triangle is half of its cross product's length.
double area_of(const MeshChunkView& chunk) {
  double area = 0;
  const auto at = [&](uint32_t v) {
    const float* p = &chunk.positions_room[3 * size_t{v}];
    return glm::vec3(p[0], p[1], p[2]);
  };
  for (size_t t = 0; t < chunk.triangles(); ++t) {
    const glm::vec3 a = at(chunk.indices[3 * t]), b = at(chunk.indices[3 * t + 1]), c = at(chunk.indices[3 * t + 2]);
    area += 0.5 * static_cast<double>(glm::length(glm::cross(b - a, c - a)));
  }
  return area;
}

// Parts of the chunks that are gathered at a time: a fixed number, so that the sums are the same on all machines.
constexpr size_t kParts = 4;

Grid gather(std::span<const MeshChunkView> chunks, const glm::vec3& origin, double cell_m) {
  std::vector<Grid> parts(kParts, Grid(origin, cell_m));
  in_parallel(size_t{0}, kParts, [&](size_t part) {
    for (size_t i = chunks.size() * part / kParts; i < chunks.size() * (part + 1) / kParts; ++i)
      parts[part].add(chunks[i]);
  });
  for (size_t part = 1; part < kParts; ++part) parts[0].add(parts[part]);
  return std::move(parts[0]);
}

// Searches for the size of the cells that gives about `most` surfels.
double find_cell(std::span<const MeshChunkView> chunks, const geometry::Box& box, size_t most) {
  const auto wanted = static_cast<double>(most);
  const glm::vec3 size = box.size();
  const double largest = double{std::max({size.x, size.y, size.z})}, least = largest / kMostCells;
  double area = 0;
  for (const MeshChunkView& chunk : chunks) area += area_of(chunk);
  double cell = std::clamp(std::sqrt(1.5 * area / wanted), least, largest);
  for (int n = 0; n < 5; ++n) {
    const double ratio = static_cast<double>(gather(chunks, box.lo, cell).cells().size()) / wanted;
    if (ratio > 0.8 && ratio < 1) break;
    cell = std::clamp(cell * std::sqrt(ratio / 0.9), least, largest);
  }
  return cell;
}

}  // namespace

Surfels make_surfels(std::span<const MeshChunkView> chunks, const geometry::Box& box_room, size_t most) {
  const double cell_m = find_cell(chunks, box_room, most);
  const Grid grid = gather(chunks, box_room.lo, cell_m);
  const bool scalars = !chunks.empty() && chunks[0].scalars;
  Surfels out{static_cast<float>(cell_m), {}, {}, {}};
  for (const Cell& cell : grid.cells()) {
    out.positions.push_back(box_room.lo + cell.position / cell.weight);
    const float length = glm::length(cell.normal);
    out.normals.push_back(image::encode_normal32(length > 0 ? cell.normal / length : glm::vec3(0, 0, 1)));
    if (scalars) {
      const float none = std::numeric_limits<float>::quiet_NaN();
      out.colours.push_back(std::bit_cast<uint32_t>(cell.colour.y > 0 ? cell.colour.x / cell.colour.y : none));
    } else {
      const glm::vec3 c = cell.colour / cell.weight + 0.5f;
      out.colours.push_back(static_cast<uint32_t>(c.x) << 16 | static_cast<uint32_t>(c.y) << 8 |
                            static_cast<uint32_t>(c.z));
    }
  }
  return out;
}

}  // namespace telesplat::data
