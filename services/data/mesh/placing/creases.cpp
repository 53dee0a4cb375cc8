#include "services/data/mesh/placing/placement.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

namespace telesplat::data {
namespace {

constexpr uint32_t kNone = UINT32_MAX;

class Creases {
 public:
  Creases(const std::vector<glm::vec3>& positions, double crease_deg, std::vector<uint32_t>& indices)
      : positions_(positions),
        indices_(indices),
        splits_(crease_deg < 180),
        cos_crease_(splits_ ? std::cos(crease_deg * M_PI / 180) : -2),
        cos_half_(std::cos(crease_deg * M_PI / 360)) {}

  SmoothNormals run() {
    add_normals();
    find_spread();
    for (size_t i = 0; i + 1 < first_.size(); ++i) split(i);
    for (const auto& [corner, index] : new_indices_) indices_[corner] = index;
    return std::move(out_);
  }

 private:
  glm::dvec3 area_of(size_t triangle) const { return area_vector(positions_, &indices_[3 * triangle]); }

  // Normals are scaled up so that those of small triangles do not vanish in float.
  void add_normals() {
    out_.normals.assign(positions_.size(), glm::vec3(0));
    for (size_t t = 0; t < indices_.size() / 3; ++t) {
      const glm::vec3 n(area_of(t) * kScale);
      for (int k = 0; k < 3; ++k) out_.normals[indices_[3 * t + k]] += n;
    }
  }

  // Finds vertices with a normal farther than half of the angle from the mean, and lists their corners. Other vertices
  // need no split, since any two of their triangles differ by less than the angle.
  void find_spread() {
    std::vector<uint32_t> number(positions_.size(), kNone);
    uint32_t count = 0;
    for (size_t t = 0; t < indices_.size() / 3; ++t) {
      const glm::dvec3 n = glm::normalize(area_of(t));
      for (int k = 0; k < 3; ++k) {
        const uint32_t vertex = indices_[3 * t + k];
        const glm::dvec3 mean(out_.normals[vertex]);
        if (number[vertex] == kNone && !(glm::dot(n, mean) >= cos_half_ * glm::length(mean))) number[vertex] = count++;
      }
    }
    first_.assign(count + 1, 0);
    for (const uint32_t vertex : indices_)
      if (number[vertex] != kNone) ++first_[number[vertex] + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    corners_.resize(first_.back());
    std::vector<size_t> next(first_.begin(), first_.end() - 1);
    for (size_t corner = 0; corner < indices_.size(); ++corner)
      if (const uint32_t n = number[indices_[corner]]; n != kNone) corners_[next[n]++] = corner;
  }

  // An edge of a triangle, from the vertex.
  struct Edge {
    uint32_t other;
    uint32_t triangle;  // its number among those around the vertex
    bool leaves;        // the triangle's winding leads along the edge away from the vertex
  };

  // Returns the root of the triangle's group, and whether its normal is turned against that of the root.
  std::pair<uint32_t, bool> group_of(uint32_t triangle) {
    uint32_t root = triangle;
    bool turned = false;
    for (; parent_[root] != root; root = parent_[root]) turned ^= turned_[root];
    for (bool rest = turned; parent_[triangle] != root && triangle != root;) {  // shorten the path for later calls
      const bool next_rest = rest ^ turned_[triangle];
      turned_[triangle] = rest;
      triangle = std::exchange(parent_[triangle], root);
      rest = next_rest;
    }
    return {root, turned};
  }

  void unite(uint32_t a, uint32_t b, bool turned) {
    const auto [first_a, turned_a] = group_of(a);
    const auto [first_b, turned_b] = group_of(b);
    if (first_a == first_b) return;
    const uint32_t low = std::min(first_a, first_b), high = std::max(first_a, first_b);
    parent_[high] = low;
    turned_[high] = turned ^ turned_a ^ turned_b;
  }

  void unite_across_edges(const size_t* corners, size_t count) {
    edges_.clear();
    for (size_t i = 0; i < count; ++i) {
      const size_t corner = corners[i], t = corner - corner % 3;
      edges_.push_back({indices_[t + (corner + 1) % 3], uint32_t(i), true});
      edges_.push_back({indices_[t + (corner + 2) % 3], uint32_t(i), false});
    }
    std::sort(edges_.begin(), edges_.end(), [](const Edge& a, const Edge& b) {
      return std::pair(a.other, a.triangle) < std::pair(b.other, b.triangle);
    });
    for (size_t first = 0, last = 0; first < edges_.size(); first = last) {
      while (last < edges_.size() && edges_[last].other == edges_[first].other) ++last;
      for (size_t e = first + 1; e < last; ++e) unite_if_smooth(edges_[e - 1], edges_[e], last - first == 2);
    }
  }

  // Where more than two triangles share an edge, two with the same direction along it belong to different sheets.
  void unite_if_smooth(const Edge& a, const Edge& b, bool alone) {
    const bool turned = a.leaves == b.leaves;
    const double cosine = glm::dot(units_[a.triangle], units_[b.triangle]);
    if ((alone || !turned) && (turned ? -cosine : cosine) >= cos_crease_) unite(a.triangle, b.triangle, turned);
  }

  void split(size_t n) {
    const size_t* corners = corners_.data() + first_[n];
    const size_t count = first_[n + 1] - first_[n];
    const uint32_t vertex = indices_[corners[0]];
    areas_.resize(count), units_.resize(count), parent_.resize(count), turned_.assign(count, false);
    for (size_t i = 0; i < count; ++i) {
      areas_[i] = area_of(corners[i] / 3);
      units_[i] = glm::normalize(areas_[i]);
      parent_[i] = uint32_t(i);
    }
    unite_across_edges(corners, count);
    sums_.assign(count, glm::dvec3(0)), as_wound_.assign(count, glm::dvec3(0));
    for (size_t i = 0; i < count; ++i) {
      const auto [group, turned] = group_of(uint32_t(i));
      sums_[group] += turned ? -areas_[i] : areas_[i];
      as_wound_[group] += areas_[i];
    }
    numbers_.assign(count, kNone);
    out_.normals[vertex] = glm::vec3(0);
    for (size_t i = 0; i < count; ++i) {
      const uint32_t group = group_of(uint32_t(i)).first;
      if (numbers_[group] == kNone) {
        numbers_[group] = group == 0 || !splits_ ? vertex : copy(vertex);
        const double sign = glm::dot(as_wound_[group], sums_[group]) < 0 ? -kScale : kScale;
        out_.normals[numbers_[group]] += glm::vec3(sums_[group] * sign);
      }
      if (numbers_[group] != vertex) new_indices_.push_back({corners[i], numbers_[group]});
    }
  }

  uint32_t copy(uint32_t vertex) {
    out_.copies.push_back(vertex);
    out_.normals.emplace_back(0);
    return uint32_t(out_.normals.size() - 1);
  }

  static constexpr double kScale = 1e12;

  const std::vector<glm::vec3>& positions_;
  std::vector<uint32_t>& indices_;
  const bool splits_;
  const double cos_crease_, cos_half_;
  SmoothNormals out_;
  std::vector<size_t> first_, corners_;  // per vertex that is split: its first corner; corners: positions in indices
  std::vector<std::pair<size_t, uint32_t>> new_indices_;  // per corner; set at the end
  // split() uses these for one vertex.
  std::vector<glm::dvec3> areas_, units_, sums_, as_wound_;  // the last two: per group
  std::vector<uint32_t> parent_, numbers_;
  std::vector<bool> turned_;
  std::vector<Edge> edges_;
};

}  // namespace

glm::dvec3 area_vector(const std::vector<glm::vec3>& positions, const uint32_t* triangle) {
  const glm::dvec3 a(positions[triangle[0]]), b(positions[triangle[1]]), c(positions[triangle[2]]);
  return glm::cross(b - a, c - a);
}

SmoothNormals smooth_normals(const std::vector<glm::vec3>& positions, double crease_deg,
                             std::vector<uint32_t>& indices) {
  return Creases(positions, crease_deg, indices).run();
}

}  // namespace telesplat::data
