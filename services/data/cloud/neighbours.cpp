#include "services/data/cloud/neighbours.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>

#include "common/geometry/box.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::data {

// A node of more points than this is divided in the middle.
static constexpr size_t kLeaf = 12, kSideBySide = 1 << 14;

struct Neighbours::Search {
  glm::vec3 at;
  uint32_t place;
  List& found;
  int count = 0;

  float reach() const { return count < kMost ? std::numeric_limits<float>::infinity() : found[kMost - 1].squared; }
  void offer(float squared, uint32_t other) {
    int i = count < kMost ? count++ : kMost - 1;
    for (; i > 0 && found[size_t(i - 1)].squared > squared; --i) found[size_t(i)] = found[size_t(i - 1)];
    found[size_t(i)] = {squared, other};
  }
};

Neighbours::Neighbours(std::vector<Point> points) : points_(std::move(points)) {
  size_t nodes = 1;
  for (size_t largest = points_.size(); largest > kLeaf; largest -= largest / 2) nodes = 2 * nodes + 1;
  splits_.resize(nodes);
  sort(0, 0, points_.size());
}

void Neighbours::sort(size_t node, size_t begin, size_t end) {
  if (end - begin <= kLeaf) return;
  geometry::Box box;
  for (size_t i = begin; i < end; ++i) box.extend(points_[i].at);
  const glm::vec3 size = box.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const size_t middle = begin + (end - begin) / 2;
  const auto at = [&](size_t i) { return points_.begin() + std::ptrdiff_t(i); };
  std::nth_element(at(begin), at(middle), at(end),
                   [axis](const Point& a, const Point& b) { return a.at[axis] < b.at[axis]; });
  splits_[node] = {points_[middle].at[axis], uint8_t(axis)};
  const auto lower = [&] { sort(2 * node + 1, begin, middle); };
  const auto upper = [&] { sort(2 * node + 2, middle, end); };
  if (end - begin > kSideBySide) return both_in_parallel(lower, upper);
  lower(), upper();
}

// away: distance from the searched place to the node's half-spaces, along each axis.
void Neighbours::visit(size_t node, size_t begin, size_t end, const glm::vec3& away, Search& search) const {
  if (end - begin <= kLeaf) {
    for (size_t i = begin; i < end; ++i) {
      const glm::vec3 way = points_[i].at - search.at;
      const float squared = glm::dot(way, way);
      if (squared < search.reach() && i != search.place) search.offer(squared, uint32_t(i));
    }
    return;
  }
  const Split& split = splits_[node];
  const size_t middle = begin + (end - begin) / 2;
  const float beyond = search.at[split.axis] - split.at;
  glm::vec3 further = away;
  further[split.axis] = beyond;
  const bool upper_first = beyond >= 0;
  const auto lower = [&](const glm::vec3& a) { visit(2 * node + 1, begin, middle, a, search); };
  const auto upper = [&](const glm::vec3& a) { visit(2 * node + 2, middle, end, a, search); };
  upper_first ? upper(away) : lower(away);
  if (glm::dot(further, further) < search.reach()) upper_first ? lower(further) : upper(further);
}

int Neighbours::nearest(uint32_t place, List& out) const {
  Search search{points_[place].at, place, out};
  visit(0, 0, points_.size(), glm::vec3(0), search);
  return search.count;
}

}  // namespace telesplat::data
