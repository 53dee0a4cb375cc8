// Cuts ears off polygons. Source: D. Eberly, "Triangulation by Ear Clipping", Geometric Tools, 2002; the grid is ours.
#include "services/data/base/polygons/polygon.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace telesplat::data {
namespace {

// Limits for tests of a point in a triangle: kMostTests per corner, and kManyTests + kFewTests per corner for a
// polygon. Only polygons that cross themselves, or were made for it, need more: the rest of them becomes a fan.
constexpr int64_t kMostTests = 500, kManyTests = 50'000'000, kFewTests = 50;
constexpr double kFlat = 1e-14;  // smaller areas, as a fraction of the polygon's, count as zero

double area_of(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

class EarCutter {
 public:
  /// points: the corners, in the polygon's plane, counterclockwise. area: twice the polygon's.
  EarCutter(std::span<const glm::dvec2> points, double area)
      : points_(points), flat_(kFlat * area), left_(points.size()) {
    const auto n = uint32_t(points.size());
    budget_ = std::min(kMostTests * n, kManyTests + kFewTests * n);
    for (uint32_t i = 0; i < n; ++i) next_.push_back((i + 1) % n), previous_.push_back((i + n - 1) % n);
    gone_.assign(n, false);
    for (uint32_t i = 0; i < n; ++i) blocks_.push_back(turn(i) <= flat_);
    sort_into_grid();
  }

  /// Calls emit(a, b, c) for each triangle.
  template <class Emit>
  void cut(Emit&& emit) {
    for (uint32_t i = 0; i < points_.size(); ++i) queue_.push_back(i);
    size_t at = 0, left_when_queued = left_;
    for (uint32_t i = 0; i < points_.size(); ++i)
      for (uint32_t k = i; left_ > 2 && !gone_[k] && is_spike(k); k = previous_[k]) remove(k, emit);
    while (left_ > 2) {
      uint32_t ear = kNone;
      while (ear == kNone && at < queue_.size())
        if (const uint32_t i = queue_[at++]; !gone_[i] && (is_spike(i) || is_ear(i))) ear = i;
      if (ear == kNone && left_ < left_when_queued && budget_ > 0) {  // cutting may have made new ears
        queue_.clear(), at = 0, left_when_queued = left_, budget_ -= int64_t(points_.size());
        for (uint32_t i = 0; i < points_.size(); ++i)
          if (!gone_[i]) queue_.push_back(i);
      } else {
        remove(ear != kNone ? ear : best_of_bad(), emit);
      }
    }
  }

 private:
  static constexpr uint32_t kNone = ~uint32_t{0};

  double turn(uint32_t i) const { return area_of(points_[previous_[i]], points_[i], points_[next_[i]]); }

  template <class Emit>
  void remove(uint32_t ear, Emit&& emit) {
    const uint32_t before = previous_[ear], after = next_[ear];
    emit(before, ear, after);
    gone_[ear] = true, --left_;
    next_[before] = after, previous_[after] = before, some_ = after;
    for (const uint32_t i : {before, after}) blocks_[i] = turn(i) <= flat_, queue_.push_back(i);
  }

  // True for a repeated point, or the end of a line that goes forth and back.
  bool is_spike(uint32_t i) const {
    return std::abs(turn(i)) <= flat_ &&
           glm::dot(points_[previous_[i]] - points_[i], points_[next_[i]] - points_[i]) >= 0;
  }

  // Only corners that turn right or not at all can lie in ears. Other corners never become such later.
  void sort_into_grid() {
    lowest_ = highest_ = points_[0];
    for (const glm::dvec2& p : points_) lowest_ = glm::min(lowest_, p), highest_ = glm::max(highest_, p);
    const auto blocking = std::count(blocks_.begin(), blocks_.end(), true);
    side_ = std::clamp(int64_t(std::sqrt(double(blocking))), int64_t{1}, int64_t{1024});
    starts_.assign(size_t(side_ * side_) + 1, 0);
    const auto cell = [&](uint32_t i) { return size_t(cell_of(points_[i], 1) * side_ + cell_of(points_[i], 0)); };
    for (uint32_t i = 0; i < points_.size(); ++i) starts_[cell(i) + 1] += blocks_[i];
    for (size_t c = 1; c < starts_.size(); ++c) starts_[c] += starts_[c - 1];
    members_.resize(size_t(blocking));
    std::vector<uint32_t> filled(starts_.begin(), starts_.end() - 1);
    for (uint32_t i = 0; i < points_.size(); ++i)
      if (blocks_[i]) members_[filled[cell(i)]++] = i;
  }
  int64_t cell_of(glm::dvec2 p, int axis) const {
    const double extent = highest_[axis] - lowest_[axis];
    return extent > 0 ? std::min(int64_t((p[axis] - lowest_[axis]) / extent * double(side_)), side_ - 1) : 0;
  }

  bool is_ear(uint32_t i) {
    if (!(turn(i) > flat_) || budget_ <= 0) return false;
    const glm::dvec2 a = points_[previous_[i]], b = points_[i], c = points_[next_[i]];
    const glm::dvec2 low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
    for (int64_t y = cell_of(low, 1); y <= cell_of(high, 1); ++y)
      for (int64_t x = cell_of(low, 0); x <= cell_of(high, 0); ++x) {
        const size_t cell = size_t(y * side_ + x);
        budget_ -= 1 + starts_[cell + 1] - starts_[cell];
        for (uint32_t m = starts_[cell]; m < starts_[cell + 1]; ++m) {
          const glm::dvec2 p = points_[members_[m]];
          // Bridges to holes have two corners at one place, which do not block each other.
          if (!gone_[members_[m]] && blocks_[members_[m]] && p != a && p != b && p != c && area_of(a, b, p) >= 0 &&
              area_of(b, c, p) >= 0 && area_of(c, a, p) >= 0)
            return false;
        }
      }
    return true;
  }

  // Without an ear the polygon crosses or touches itself: returns a corner without area, else one that turns left.
  uint32_t best_of_bad() {
    uint32_t left = kNone, i = some_;
    for (; budget_ > 0; --budget_) {
      const double area = turn(i);
      if (std::abs(area) <= flat_) return i;
      if (area > 0 && left == kNone) left = i;
      if ((i = next_[i]) == some_) break;
    }
    return left != kNone ? left : next_[some_];
  }

  std::span<const glm::dvec2> points_;
  const double flat_;
  size_t left_;  // corners that are not cut yet
  int64_t budget_;
  std::vector<uint32_t> next_, previous_, queue_;
  std::vector<bool> gone_, blocks_;
  uint32_t some_ = 0;  // a corner that is not cut yet
  glm::dvec2 lowest_{}, highest_{};
  int64_t side_ = 1;  // cells of the grid along an axis
  std::vector<uint32_t> starts_, members_;
};

}  // namespace

void cut_corners(std::span<const uint32_t> ring, std::span<const glm::dvec3> positions, std::vector<uint32_t>& cut) {
  const auto count = uint32_t(ring.size());
  const auto fan = [&] {
    for (uint32_t i = 2; i < count; ++i) cut.insert(cut.end(), {0, i - 1, i});
  };
  if (count <= 3) return fan();
  const glm::dvec3 origin = positions[ring[0]];
  const auto at = [&](size_t i) { return positions[ring[i]] - origin; };
  glm::dvec3 area(0);  // twice the polygon's area, along its normal
  for (size_t i = 2; i < count; ++i) area += glm::cross(at(i - 1), at(i));
  const double size = glm::length(area);
  if (!(size > 0) || !std::isfinite(size)) return fan();
  // If each triangle of the fan turns as the polygon does, the whole polygon is visible from the first corner.
  const glm::dvec3 normal = area / size;
  bool all_seen = true;
  for (size_t i = 2; i < count && all_seen; ++i)
    all_seen = glm::dot(glm::cross(at(i - 1), at(i)), normal) >= -1e-9 * size;
  if (all_seen) return fan();

  const glm::dvec3 aside = std::abs(normal.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(aside, normal)), v = glm::cross(normal, u);
  std::vector<glm::dvec2> points;
  points.reserve(count);
  for (size_t i = 0; i < count; ++i) points.emplace_back(glm::dot(at(i), u), glm::dot(at(i), v));
  EarCutter(points, size).cut([&](uint32_t a, uint32_t b, uint32_t c) { cut.insert(cut.end(), {a, b, c}); });
}

void cut_polygon(std::span<const uint32_t> ring, std::span<const glm::dvec3> positions,
                 std::vector<uint32_t>& indices) {
  if (ring.size() == 3) {
    for (const uint32_t vertex : ring) indices.push_back(vertex);
    return;
  }
  const size_t before = indices.size();
  cut_corners(ring, positions, indices);
  for (size_t i = before; i < indices.size(); ++i) indices[i] = ring[indices[i]];
}

}  // namespace telesplat::data
