#include <algorithm>
#include <cmath>
#include <queue>

#include "tools/make_terrain/relief.h"

namespace telesplat::terrain {
namespace {

constexpr int kDx[8] = {1, -1, 0, 0, 1, 1, -1, -1}, kDy[8] = {0, 0, 1, -1, 1, -1, 1, -1};
constexpr double kDistance[8] = {1, 1, 1, 1, 1.41421356, 1.41421356, 1.41421356, 1.41421356};
constexpr double kExponent = 0.45;  // of the drainage area
constexpr double kTalus = 0.9;      // slopes above slide

class Eroder {
 public:
  Eroder(HeightMap& map, const std::vector<uint8_t>& fixed)
      : map_(map), fixed_(fixed), n_(map.side), cells_(map.height_m.size()) {}

  void step(double k) {
    flood();
    route();
    cut(k);
    slide();
  }

 private:
  bool is_outlet(int cell) const {
    const int x = cell % n_, y = cell / n_;
    return fixed_[cell] || x == 0 || y == 0 || x == n_ - 1 || y == n_ - 1;
  }
  template <class Visit>
  void neighbours(int cell, const Visit& visit) const {
    const int x = cell % n_, y = cell / n_;
    for (int d = 0; d < 8; ++d) {
      const int nx = x + kDx[d], ny = y + kDy[d];
      if (nx >= 0 && ny >= 0 && nx < n_ && ny < n_) visit(ny * n_ + nx, d);
    }
  }

  // Raises pits until everything drains to an outlet; order_ lists the cells from the outlets upwards.
  void flood() {
    using Entry = std::pair<float, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    order_.clear();
    order_.reserve(cells_);
    rank_.assign(cells_, -1);
    for (int c = 0; c < static_cast<int>(cells_); ++c)
      if (is_outlet(c)) queue.emplace(map_.height_m[c], c), rank_[c] = 0;
    while (!queue.empty()) {
      const auto [height, cell] = queue.top();
      queue.pop();
      rank_[cell] = static_cast<int>(order_.size());
      order_.push_back(cell);
      neighbours(cell, [&, height = height](int next, int) {
        if (rank_[next] >= 0) return;
        rank_[next] = 0;
        map_.height_m[next] = std::max(map_.height_m[next], height + 0.02f);
        queue.emplace(map_.height_m[next], next);
      });
    }
  }

  // Each cell drains to its steepest neighbour; what it drains is its own area and that of all above it.
  void route() {
    receiver_.assign(cells_, -1);
    distance_.assign(cells_, 1.0f);
    area_.assign(cells_, static_cast<float>(map_.cell_m() * map_.cell_m()));
    for (int cell : order_) {
      if (is_outlet(cell)) continue;
      double steepest = 0;
      neighbours(cell, [&](int next, int d) {
        const double slope = (map_.height_m[cell] - map_.height_m[next]) / kDistance[d];
        if (rank_[next] < rank_[cell] && slope > steepest) {
          steepest = slope;
          receiver_[cell] = next;
          distance_[cell] = static_cast<float>(kDistance[d] * map_.cell_m());
        }
      });
    }
    for (auto cell = order_.rbegin(); cell != order_.rend(); ++cell)
      if (receiver_[*cell] >= 0) area_[receiver_[*cell]] += area_[*cell];
  }

  void cut(double k) {
    for (int cell : order_) {
      const int below = receiver_[cell];
      if (below < 0) continue;
      const double f = k * std::pow(area_[cell], kExponent) / distance_[cell];
      map_.height_m[cell] = static_cast<float>((map_.height_m[cell] + f * map_.height_m[below]) / (1 + f));
    }
  }

  // Half of what is too steep moves down.
  void slide() {
    const double limit = kTalus * map_.cell_m();
    for (int y = 1; y < n_ - 1; ++y)
      for (int x = 1; x < n_ - 1; ++x) {
        const int cell = y * n_ + x;
        neighbours(cell, [&](int next, int d) {
          const double excess = map_.height_m[cell] - map_.height_m[next] - limit * kDistance[d];
          if (excess <= 0 || fixed_[cell]) return;
          const auto moved = static_cast<float>(0.25 * excess);
          map_.height_m[cell] -= moved;
          if (!fixed_[next]) map_.height_m[next] += moved;
        });
      }
  }

  HeightMap& map_;
  const std::vector<uint8_t>& fixed_;
  int n_;
  size_t cells_;
  std::vector<int> order_, rank_, receiver_;
  std::vector<float> distance_, area_;
};

}  // namespace

void erode(HeightMap& map, const std::vector<uint8_t>& fixed, int steps, double k,
           const std::function<void(double)>& progress) {
  Eroder eroder(map, fixed);
  for (int i = 0; i < steps; ++i) {
    progress(static_cast<double>(i) / steps);
    eroder.step(k);
  }
}

}  // namespace telesplat::terrain
