#include "tools/make_terrain/relief.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "common/parallel/in_parallel.h"
#include "tools/make_terrain/noise.h"

namespace telesplat::terrain {
namespace {

constexpr int kSide = 560;  // cells of 25 m: finer forms are noise (terrain.cpp)
constexpr double kRimRadiusM = 3300, kFloorM = 1480, kRimM = 2330, kFootM = 1050;
constexpr double kPi = 3.14159265358979323846;

// A cone with a crater, `radius` wide at its foot; 0 outside.
double cone(double distance, double radius, double height) {
  if (distance >= radius) return 0;
  const double t = 1 - distance / radius;
  return height * (t - 0.9 * std::max(t - 0.82, 0.0) * 2) * smooth(0, 0.2, t);
}

double initial_height(double x, double y, uint64_t seed) {
  const Noise noise(seed), warp(seed + 1), rough(seed + 2);
  // Bend the coordinates so that nothing is round or straight.
  const double wx = x + 420 * warp.fractal(x / 2600, y / 2600, 4),
               wy = y + 420 * warp.fractal(x / 2600 + 40, y / 2600 + 40, 4);
  const double c = kExtentM / 2, r = caldera_radius(x, y, seed), angle = std::atan2(y - c, x - c);
  const double rim = kRimM + 330 * noise.fractal(2 + 1.1 * std::cos(angle), 5 + 1.1 * std::sin(angle), 2) +
                     140 * noise.fractal(wx / 1100, wy / 1100, 4);
  const double outside = kFootM + (rim - kFootM) * std::exp(-std::max(r - 1, 0.0) * 1.15);
  const double inside = kFloorM + (rim - kFloorM) * smooth(0.66, 1.0, r);
  double h = r < 1 ? inside : outside;
  // Ridges on the flanks, less in the lake.
  const double flank = smooth(0.95, 1.3, r);
  h += flank * (460 * (rough.ridged(wx / 3000, wy / 3000, 5) - 0.55)) +
       (20 + 60 * flank) * rough.fractal(wx / 700, wy / 700, 5);
  // Side cones around the caldera, and the island in it.
  for (uint64_t i = 0; i < 9; ++i) {
    const double a = 2 * kPi * (static_cast<double>(i) / 9 + 0.08 * noise.uniform(3 * i)),
                 d = kRimRadiusM * (1.35 + 0.75 * noise.uniform(3 * i + 1));
    const double size = 700 + 900 * noise.uniform(3 * i + 2);
    h += cone(std::hypot(wx - c - d * std::cos(a), wy - c - d * std::sin(a)), size, 0.36 * size);
  }
  const double a = 2 * kPi * noise.uniform(100), d = 0.45 * kRimRadiusM;
  const double island = std::hypot(x - c - d * std::cos(a) + 0.5 * (wx - x), y - c - d * std::sin(a) + 0.5 * (wy - y));
  return h + cone(island * (1 + 0.25 * rough.fractal(x / 350, y / 350, 3)), 1150, 880);
}

constexpr int kDx[8] = {1, -1, 0, 0, 1, 1, -1, -1}, kDy[8] = {0, 0, 1, -1, 1, -1, 1, -1};
constexpr double kDistance[8] = {1, 1, 1, 1, 1.41421356, 1.41421356, 1.41421356, 1.41421356};
constexpr double kExponent = 0.45;  // exponent of the drainage area
constexpr double kTalus = 0.9;      // steeper slopes slide

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

  // Finds each cell's steepest neighbour downhill; a cell's area is its own and that of all cells above it.
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

  // Moves half of what is too steep down.
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

// Cuts valleys: each step routes water over the filled surface to the lowest neighbour, and lowers the ground by the
// stream-power law dh/dt = -k A^m S, implicitly; then slopes steeper than `talus` slide. Cells of `fixed` and the
// border keep their height. Source: Braun and Willett, "A very efficient O(n), implicit and parallel method to solve
// the stream power equation", Geomorphology 180, 2013; Barnes et al., "Priority-flood", Computers & Geosciences 62,
// 2014.
void erode(HeightMap& map, const std::vector<uint8_t>& fixed, int steps, double k,
           const std::function<void(double)>& progress) {
  Eroder eroder(map, fixed);
  for (int i = 0; i < steps; ++i) {
    progress(static_cast<double>(i) / steps);
    eroder.step(k);
  }
}

}  // namespace

double caldera_radius(double x, double y, uint64_t seed) {
  const Noise noise(seed + 3);
  const double c = kExtentM / 2, dx = (x - c) * 0.93, dy = (y - c) * 1.05, distance = std::hypot(dx, dy);
  const double angle = std::atan2(dy, dx);
  const double outline = 1 + 0.2 * noise.fractal(1.3 * std::cos(angle) + 7, 1.3 * std::sin(angle) + 7, 3) +
                         0.05 * noise.fractal(x / 800, y / 800, 4);
  return distance / (kRimRadiusM * outline);
}

double HeightMap::sample(double x_m, double y_m) const {
  const double gx = std::clamp(x_m / cell_m(), 0.0, side - 1.0), gy = std::clamp(y_m / cell_m(), 0.0, side - 1.0);
  const int ix = std::min(static_cast<int>(gx), side - 2), iy = std::min(static_cast<int>(gy), side - 2);
  const auto weights = [](double t, double(&w)[4]) {
    w[0] = 0.5 * (-t + 2 * t * t - t * t * t), w[1] = 0.5 * (2 - 5 * t * t + 3 * t * t * t);
    w[2] = 0.5 * (t + 4 * t * t - 3 * t * t * t), w[3] = 0.5 * (-t * t + t * t * t);
  };
  double wx[4], wy[4], sum = 0;
  weights(gx - ix, wx), weights(gy - iy, wy);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      sum += wy[j] * wx[i] * at(std::clamp(ix + i - 1, 0, side - 1), std::clamp(iy + j - 1, 0, side - 1));
  return sum;
}

HeightMap make_relief(uint64_t seed, const std::function<void(double)>& progress) {
  HeightMap map{kSide, std::vector<float>(static_cast<size_t>(kSide) * kSide)};
  std::vector<uint8_t> lake(map.height_m.size());
  in_parallel(0, kSide, [&](int y) {
    for (int x = 0; x < kSide; ++x) {
      const double x_m = x * map.cell_m(), y_m = y * map.cell_m();
      map.at(x, y) = static_cast<float>(initial_height(x_m, y_m, seed));
      lake[static_cast<size_t>(y) * kSide + x] = map.at(x, y) < kLakeLevelM && caldera_radius(x_m, y_m, seed) < 1;
    }
  });
  erode(map, lake, 12, 0.027, progress);
  return map;
}

}  // namespace telesplat::terrain
