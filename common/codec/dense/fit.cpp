#include "common/codec/dense/fit.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "common/codec/poles.h"

namespace telesplat::codec::detail {
namespace {

constexpr size_t kLeastSlopes = 32, kEnoughSlopes = 100;
constexpr double kLeastAgreement = 0.7;  // mean cosine between normals and those of the fitted geometry

struct Slope {
  double h[3];  // slopes and height, as in geometry()
  double n[3];  // unit normal
};

int shift_for(double size, double most) {
  int shift = 0;
  while (size > most && shift < 15) size /= 2, ++shift;
  return shift;
}

// Returns the size that nine of ten do not exceed.
double nine_of_ten(std::vector<double>& sizes) {
  const auto at = sizes.begin() + static_cast<ptrdiff_t>(sizes.size() * 9 / 10);
  std::nth_element(sizes.begin(), at, sizes.end());
  return *at;
}

struct Differences {
  int right, down;
};
Differences differences_at(const Plane<uint32_t>& depth, const Samples::Place& p) {
  const uint32_t* const row = depth.row(p.y);
  return {static_cast<int>(row[p.x + 1] - row[p.x - 1]),
          static_cast<int>(depth.row(p.y + 1)[p.x] - depth.row(p.y - 1)[p.x])};
}

// The same numbers as in geometry(), before its last shift. False: a slope is too large.
bool slope_at(const Plane<uint32_t>& depth, const Samples::Place& p, int x0, int y0, int shift, double h[3]) {
  const Differences d = differences_at(depth, p);
  const int u = d.right >> shift, v = d.down >> shift;
  if (std::abs(u) > 32767 || std::abs(v) > 32767) return false;
  h[0] = u, h[1] = v;
  h[2] = static_cast<double>(static_cast<int>(depth.row(p.y)[p.x] << 1) >> shift) - static_cast<double>(p.x + x0) * u -
         static_cast<double>(p.y + y0) * v;
  return true;
}

void unit_normal(const Plane<int16_t>* const normal[2], const Samples::Place& p, double n[3]) {
  const int x = normal[0]->row(p.y)[p.x] >> 6, y = normal[1]->row(p.y)[p.x] >> 6;
  const LatticePoint point = lattice_point(static_cast<uint16_t>(x | y << 8));
  const double length = std::sqrt(point.x * point.x + point.y * point.y + point.z * point.z);
  n[0] = point.x / length, n[1] = point.y / length, n[2] = point.z / length;
}

// Returns the mean of n . A h / |A h|.
double agreement(const std::vector<Slope>& slopes, const double m[9]) {
  double sum = 0;
  for (const Slope& s : slopes) {
    double dot = 0, square = 1e-30;
    for (int a = 0; a < 3; ++a) {
      const double e = m[3 * a] * s.h[0] + m[3 * a + 1] * s.h[1] + m[3 * a + 2] * s.h[2];
      dot += e * s.n[a], square += e * e;
    }
    sum += dot / std::sqrt(square);
  }
  return sum / static_cast<double>(slopes.size());
}

}  // namespace

void Samples::choose(const TileShape& shape, size_t about) {
  places.clear();
  const int w = static_cast<int>(shape.width), h = static_cast<int>(shape.height);
  const double area = static_cast<double>(shape.total);
  const int step = about == 0 ? 1 : std::max(1, static_cast<int>(std::sqrt(area / static_cast<double>(about))));
  const auto inside = [&](int x, int y) {
    return x < 0 || y < 0 || x >= w || y >= h || shape.at(size_t(x), size_t(y));
  };
  for (int y = 0, row = 0; y < h; y += step, ++row)
    for (int x = row * 7 % step; x < w; x += step)
      if (shape.mask == nullptr ||
          (inside(x, y) && inside(x - 1, y) && inside(x + 1, y) && inside(x, y - 1) && inside(x, y + 1)))
        places.push_back({x, y});
}

bool fit_geometry(const Samples& samples, const TileShape& shape, const Plane<uint32_t>& depth,
                  const Plane<int16_t>* const normal[2], const double matrix[9], GeometryModel& model) {
  if (samples.places.size() < kLeastSlopes) return false;
  const int x0 = -static_cast<int>(shape.width / 2), y0 = -static_cast<int>(shape.height / 2);
  const size_t every = std::max<size_t>(1, samples.places.size() / kEnoughSlopes);
  std::vector<double> sizes;
  for (size_t i = 0; i < samples.places.size(); i += every) {
    const Differences d = differences_at(depth, samples.places[i]);
    sizes.push_back(std::max(std::abs(static_cast<double>(d.right)), std::abs(static_cast<double>(d.down))));
  }
  model.slope_shift = shift_for(nine_of_ten(sizes) * 2, 32767);
  std::vector<Slope> slopes;
  sizes.clear();
  for (size_t i = 0; i < samples.places.size(); i += every) {
    Slope s;
    if (!slope_at(depth, samples.places[i], x0, y0, model.slope_shift, s.h)) continue;
    unit_normal(normal, samples.places[i], s.n);
    slopes.push_back(s), sizes.push_back(std::abs(s.h[2]));
  }
  if (slopes.empty() || !(agreement(slopes, matrix) > kLeastAgreement)) return false;
  model.height_shift = shift_for(std::max(1.0, nine_of_ten(sizes)) * 2, 32767);
  // Scales to integers whose sum geometry() allows.
  double total = 0, value[9];
  for (int a = 0; a < 9; ++a)
    total += std::abs(value[a] = a % 3 == 2 ? std::ldexp(matrix[a], model.height_shift) : matrix[a]);
  if (!(total > 0) || !std::isfinite(total)) return false;
  for (int a = 0; a < 9; ++a)
    model.matrix[a / 3][a % 3] = static_cast<int16_t>(std::lround(value[a] * (kMostMatrix - 16) / total));
  return true;
}

namespace {

// Features of a sample: 13 differences from the guide at the pixel, the residual, 1, and the wanted value.
constexpr int kUnknown = 14, kWanted = 14, kLeft = 0, kUp = 1, kCorner = 2;
constexpr int kPlaces[13] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, kOtherResidual};  // places in weights
// The first solution and the first kRoughRounds rounds use half of the samples.
constexpr int kRounds = 3, kRoughRounds = 1;

struct Features {
  float of[kFeatures];
};

Features features_at(const GuidedSamples& s, const Samples::Place& p) {
  const int c = s.guide.row(p.y)[p.x];
  Features out{};
  const auto set = [&](int place, const Plane<int16_t>& plane, int dx, int dy) {
    out.of[place] = static_cast<float>(plane.row(p.y + dy)[p.x + dx] - c);
  };
  set(kLeft, s.values, -1, 0), set(kUp, s.values, 0, -1), set(kCorner, s.values, -1, -1), set(3, s.values, 1, -1);
  for (int i = 0, place = 4; i < 9; ++i)
    if (i != 4) set(place++, s.guide, i % 3 - 1, i / 3 - 1);
  if (s.residuals != nullptr) out.of[12] = static_cast<float>(s.residuals->row(p.y)[p.x]);
  out.of[13] = 64;
  set(kWanted, s.values, 0, 0);
  return out;
}

// Solves A x = b for symmetric positive A, in place, by Cholesky's method. False: A is singular.
bool solve(double a[kUnknown][kUnknown], double* b) {
  for (int j = 0; j < kUnknown; ++j) {
    for (int i = j; i < kUnknown; ++i) {
      double s = a[i][j];
      for (int k = 0; k < j; ++k) s -= a[i][k] * a[j][k];
      if (i == j && !(s > 0)) return false;
      a[i][j] = i == j ? std::sqrt(s) : s / a[j][j];
    }
  }
  for (int i = 0; i < kUnknown; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (int i = kUnknown; i-- > 0;) {
    for (int k = i + 1; k < kUnknown; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return true;
}

// Solves weighted least squares of the first n samples. False: the system is singular.
bool solve_weighted(const std::vector<Features>& all, const std::vector<float>& weights, size_t n,
                    double solution[kUnknown]) {
  alignas(64) float sums[kFeatures][kFeatures];
  normal_equations(&all[0].of, weights.data(), n, sums);
  double system[kUnknown][kUnknown], trace = 0;
  for (int i = 0; i < kUnknown; ++i) trace += static_cast<double>(sums[i][i]);
  for (int i = 0; i < kUnknown; ++i) {
    for (int j = 0; j < kUnknown; ++j) system[i][j] = static_cast<double>(sums[i][j]);
    system[i][i] += trace * 1e-6 + 1e-9;
    solution[i] = static_cast<double>(sums[kWanted][i]);
  }
  return solve(system, solution);
}

// Error of a solution in one sample.
float miss(const Features& f, const double solution[kUnknown]) {
  float sum = -f.of[kWanted];
  for (int i = 0; i < kUnknown; ++i) sum += static_cast<float>(solution[i]) * f.of[i];
  return sum;
}

float median_miss(const Features& f) {
  const float low = std::min(f.of[kLeft], f.of[kUp]), high = std::max(f.of[kLeft], f.of[kUp]);
  return std::clamp(f.of[kLeft] + f.of[kUp] - f.of[kCorner], low, high) - f.of[kWanted];
}

// The mean token of prediction errors, over every third sample: it grows with the bits.
template <class Off>
double tokens_left(const std::vector<Features>& all, int bits, Off off) {
  const float scale = 2 / static_cast<float>(1 << bits);
  uint64_t sum = 0, count = 0;
  for (size_t s = 0; s < all.size(); s += 3, ++count)
    sum += token_of(static_cast<uint32_t>(std::min(std::abs(off(all[s])) * scale, 1e6f)));
  return static_cast<double>(sum) / static_cast<double>(count);
}

// Converts the weights of differences to weights of the values themselves. False: one is too large.
bool quantise_weights(const double solution[kUnknown], GuidedFit& out) {
  int total = 0, sum = 0;
  for (int i = 0; i < 13; ++i) {
    if (!(std::abs(solution[i]) < 3.9)) return false;
    int16_t& w = out.weights[kPlaces[i]];
    w = static_cast<int16_t>(std::lround(solution[i] * 8192));
    total += std::abs(w);
    if (kPlaces[i] != kOtherResidual) sum += w;
  }
  if (total + std::abs(8192 - sum) > kMostWeight || std::abs(8192 - sum) > 32767) return false;
  out.weights[kGuideHere] = static_cast<int16_t>(8192 - sum);
  out.constant = static_cast<int32_t>(std::lround(std::clamp(solution[13], -3.0, 3.0) * 64 * 8192));
  return true;
}

}  // namespace

GuidedFit fit_guided(const GuidedSamples& of) {
  const std::vector<Samples::Place>& places = of.samples.places;
  const size_t n = places.size(), few = n / 2;  // the first rounds need not be exact
  GuidedFit out;
  out.left_over = std::numeric_limits<double>::infinity();
  if (n < 64) return out;
  std::vector<Features> all(n);
  std::vector<float> shares(n);
  for (size_t s = 0; s < n; ++s) {
    all[s] = features_at(of, places[s < few ? 2 * s : std::min(2 * (s - few) + 1, n - 1)]);
    const float* const f = all[s].of;
    const float near = 64 + std::abs(f[kWanted] - f[kLeft]) + std::abs(f[kWanted] - f[kUp]) + std::abs(f[kWanted]) / 4;
    shares[s] = 1 / (near * near);
  }
  double solution[kUnknown];
  bool solved = solve_weighted(all, shares, few, solution);
  for (int round = 0; solved && round < kRounds; ++round) {  // towards the median, at last beyond it
    const bool last = round + 1 == kRounds;
    const size_t count = round < kRoughRounds ? few : n;
    for (size_t s = 0; s < count; ++s) {
      const float size = (last ? 64.0f : 24.0f) + std::abs(miss(all[s], solution));
      shares[s] = 1 / (last ? size * size : size);
    }
    solved = solve_weighted(all, shares, count, solution);
  }
  const double by_median = tokens_left(all, of.bits, median_miss),
               by_weights = solved ? tokens_left(all, of.bits, [&](const Features&f) { return miss(f, solution); })
                                   : out.left_over;
  out.left_over = std::min(by_median, by_weights);
  out.better_than_median = by_weights < by_median && quantise_weights(solution, out);
  return out;
}

}  // namespace telesplat::codec::detail
