#include "common/codec/dense/height.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace telesplat::codec::detail {
namespace {

constexpr int kBins = HeightModel::kKnots - 1;
constexpr int kRounds = 2, kSteps = 4;  // towards an axis that nobody knows: more take longer than they save

struct Axis {
  double a, b, c;
  double of(const HeightSample& s) const { return (a * double{s.x} + b * double{s.y} + c) / double{s.code}; }
};

// The solution of n equations, whose right sides are the last column; the diagonal grows by `more` of itself. False
// where there is none.
template <int kN>
bool solve_system(double m[kN][kN + 1], double more, double out[kN]) {
  for (int i = 0; i < kN; ++i) m[i][i] *= 1 + more;
  for (int i = 0; i < kN; ++i) {
    if (!(std::abs(m[i][i]) > 0)) return false;
    for (int k = i + 1; k < kN; ++k) {
      const double f = m[k][i] / m[i][i];
      for (int j = i; j <= kN; ++j) m[k][j] -= f * m[i][j];
    }
  }
  for (int i = kN; i-- > 0;) {
    out[i] = m[i][kN];
    for (int j = i + 1; j < kN; ++j) out[i] -= m[i][j] * out[j];
    out[i] /= m[i][i];
    if (!std::isfinite(out[i])) return false;
  }
  return true;
}

// Changes of colour from one sample to the next one up the axis; every fourth is enough.
double roughness(const Axis& axis, const std::vector<HeightSample>& samples) {
  std::vector<std::pair<double, uint32_t>> order;
  for (size_t i = 0; i < samples.size(); i += 4) order.emplace_back(axis.of(samples[i]), samples[i].colour);
  std::sort(order.begin(), order.end());
  double sum = 0;
  for (size_t i = 1; i < order.size(); ++i)
    for (int shift = 0; shift < 24; shift += 8)
      sum += std::abs(int(order[i].second >> shift & 255) - int(order[i - 1].second >> shift & 255));
  return sum;
}

// The axes by which the colours' channels change most evenly, by least squares; false where there are none.
bool even_axes(const std::vector<HeightSample>& samples, Axis axes[3]) {
  double unit = 0;
  for (const HeightSample& s : samples) unit += double{s.code};
  unit /= static_cast<double>(samples.size());
  double sums[4][7] = {};
  for (const HeightSample& s : samples) {
    const double k = unit / double{s.code};
    double f[7] = {k * double{s.x}, k * double{s.y}, k, 1};
    for (int c = 0; c < 3; ++c) f[4 + c] = static_cast<double>(s.colour >> 8 * c & 255);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 7; ++j) sums[i][j] += f[i] * f[j];
  }
  for (int c = 0; c < 3; ++c) {
    double m[4][5], out[4];
    for (int i = 0; i < 4; ++i) std::copy_n(sums[i], 4, m[i]), m[i][4] = sums[i][4 + c];
    if (!solve_system<4>(m, 1e-12, out)) return false;
    axes[c] = {out[0] * unit, out[1] * unit, out[2] * unit};
  }
  return true;
}

// Each colour's place in the order of its colours' mean heights.
void rank_colours(const Axis& axis, const std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
                  std::vector<uint32_t>& rank) {
  std::vector<double> mean(first.size());
  std::vector<float> count(first.size(), 1);
  for (size_t i = 0; i < first.size(); ++i) mean[i] = axis.of(first[i]);
  for (const HeightSample& s : samples) mean[s.place] += axis.of(s), count[s.place] += 1;
  for (size_t i = 0; i < mean.size(); ++i) mean[i] /= double{count[i]};
  const auto [low, high] = std::minmax_element(mean.begin(), mean.end());
  const double unit = 0xFFFFFFFFu / std::max(*high - *low, 1e-300);
  std::vector<uint64_t> order;  // heights, and in the lower half whose they are: integers are sorted twice as fast
  for (uint32_t i = 0; i < mean.size(); ++i) {
    const double height = (mean[i] - *low) * unit;
    const uint32_t whole = !(height > 0) ? 0 : height < 0xFFFFFFFFu ? static_cast<uint32_t>(height) : 0xFFFFFFFFu;
    order.push_back(uint64_t{whole} << 32 | i);
  }
  std::sort(order.begin(), order.end());
  rank.resize(first.size());
  for (uint32_t i = 0; i < order.size(); ++i) rank[static_cast<uint32_t>(order[i])] = i;
}

// Least squares of hat functions: a tridiagonal system, which a little smoothness makes regular.
class HatFunctions {
 public:
  HatFunctions() { std::fill_n(diagonal_, HeightModel::kKnots, 1e-6); }
  // t: 0 to kBins.
  void add(double t, double value, double weight) {
    t = std::clamp(t, 0.0, kBins - 1e-9);
    const int i = static_cast<int>(t);
    const double f = t - i, g = 1 - f;
    diagonal_[i] += weight * g * g, diagonal_[i + 1] += weight * f * f, side_[i] += weight * f * g;
    right_[i] += weight * g * value, right_[i + 1] += weight * f * value;
  }
  void solve(double smoothness, double knots[HeightModel::kKnots]) {
    for (int i = 0; i < kBins; ++i) diagonal_[i] += smoothness, diagonal_[i + 1] += smoothness, side_[i] -= smoothness;
    for (int i = 1; i < HeightModel::kKnots; ++i) {
      const double f = side_[i - 1] / diagonal_[i - 1];
      diagonal_[i] -= f * side_[i - 1], right_[i] -= f * right_[i - 1];
    }
    for (int i = HeightModel::kKnots; i-- > 0;)
      knots[i] = (right_[i] - (i + 1 < HeightModel::kKnots ? side_[i] * knots[i + 1] : 0)) / diagonal_[i];
  }

 private:
  double diagonal_[HeightModel::kKnots], side_[HeightModel::kKnots] = {}, right_[HeightModel::kKnots] = {};
};

struct Curve {
  double low = 0, step = 1;
  double knots[HeightModel::kKnots] = {};
  double at(double s, double* slope = nullptr) const {
    const double t = std::clamp((s - low) / step, 0.0, kBins - 1e-9);
    const int i = static_cast<int>(t);
    if (slope != nullptr) *slope = (knots[i + 1] - knots[i]) / step;
    return knots[i] + (knots[i + 1] - knots[i]) * (t - i);
  }
};

// Mean indices by height: knots between bins.
Curve fit_curve(const Axis& axis, const std::vector<HeightSample>& samples) {
  Curve curve;
  std::vector<double> heights;
  for (const HeightSample& s : samples) heights.push_back(axis.of(s));
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  curve.low = *low, curve.step = std::max((*high - *low) / kBins, 1e-12);
  HatFunctions hats;
  for (size_t n = 0; n < samples.size(); ++n) hats.add((heights[n] - curve.low) / curve.step, samples[n].index, 1);
  hats.solve(0.05, curve.knots);
  return curve;
}

// One step of Gauss and Newton towards the axis by which the curve explains the indices best.
void improve(Axis& axis, const Curve& curve, const std::vector<HeightSample>& samples) {
  double m[3][4] = {};
  for (const HeightSample& s : samples) {
    double slope = 0;
    const double r = static_cast<double>(s.index) - curve.at(axis.of(s), &slope);
    const double weight = 1 / (4 + r * r), k = slope / double{s.code};
    const double f[4] = {k * double{s.x}, k * double{s.y}, k, r};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) m[i][j] += weight * f[i] * f[j];
  }
  double d[3];
  if (!solve_system<3>(m, 1e-4, d)) return;
  axis.a += d[0], axis.b += d[1], axis.c += d[2];
}

// The axis in the integers of heights(), counted from the middle of the tile's heights, so that few steps of these are
// lost.
bool quantise(const Axis& axis, const std::vector<HeightSample>& samples, HeightModel& model) {
  double low = 1e300, high = -1e300;
  for (const HeightSample& s : samples) low = std::min(low, axis.of(s)), high = std::max(high, axis.of(s));
  // Quotients lie within 0.45, and within 1 for a base that is a whole number, and what is beyond the samples.
  const double unit = 0.9 / std::max(high - low, 1e-300), base = std::round((low + high) / 2 * unit);
  for (const double v : {axis.a * unit, axis.b * unit, axis.c * unit, base})
    if (!(std::abs(v) < 2147483000.0)) return false;
  model.a = static_cast<int32_t>(std::lround(axis.a * unit));
  model.b = static_cast<int32_t>(std::lround(axis.b * unit));
  model.c = static_cast<int32_t>(std::lround(axis.c * unit));
  model.base = static_cast<int32_t>(base);
  const double range = (high - low) * unit * 16384;
  model.low = static_cast<int32_t>(std::floor((low * unit - base) * 16384));
  model.scale =
      static_cast<int32_t>(std::clamp(std::floor(16383 * 4096.0 / std::max(range + 1, 1025.0)), 1.0, 65535.0));
  return true;
}

}  // namespace

bool axes_of(const GeometryModel& g, RoomAxes& rays) {
  RoomAxes m;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) m[i][j] = j == 2 ? g.matrix[i][j] / std::pow(2.0, g.height_shift) : g.matrix[i][j];
  return inverse_transpose(m, rays);
}

bool inverse_transpose(const RoomAxes& m, RoomAxes& out) {
  double determinant = 0;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) {
      const size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      out[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
      if (i == 0) determinant += m[i][j] * out[i][j];
    }
  if (!(std::abs(determinant) > 0)) return false;
  for (auto& row : out)
    for (double& e : row) e /= determinant;
  return true;
}

namespace {

// Of colours that `axis` sorts: how far they are from what their heights say, as a share of how far they are spread.
double unexplained(const Axis& axis, std::vector<HeightSample>& samples, const std::vector<HeightSample>& first) {
  std::vector<uint32_t> rank;
  rank_colours(axis, samples, first, rank);
  for (HeightSample& s : samples) s.index = rank[s.place];
  const Curve curve = fit_curve(axis, samples);
  double error = 0, spread = 0;
  for (const HeightSample& s : samples) {
    error += std::abs(curve.at(axis.of(s)) - s.index);
    spread += std::abs(static_cast<double>(first.size()) / 2 - s.index);
  }
  return error < spread ? error / spread : 1;
}

}  // namespace

bool find_axis(const KnownAxes& known, std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
               double axis[3]) {
  constexpr double kWell = 0.1, kEnough = 0.25;  // unexplained
  if (samples.size() < 128 || first.size() < 8) return false;
  Axis best{};
  double least = 1e300;
  const auto consider = [&](const Axis& candidate) {
    const double rough = roughness(candidate, samples);
    if (!(rough < least)) return false;
    least = rough, best = candidate;
    return true;
  };
  const auto choose = [&] {
    axis[0] = best.a, axis[1] = best.b, axis[2] = best.c;
    return unexplained(best, samples, first);
  };
  if (known.axes != nullptr)
    for (const auto& [a, b, c] : *known.axes) consider({a, b, c});
  bool exact = known.exact && least < 1e300;
  if (exact && choose() < kWell) return true;
  if (Axis even[3]; even_axes(samples, even))
    for (const Axis& candidate : even) exact &= !consider(candidate);
  if (!(least < 1e300)) return false;
  for (int round = 0; round < kRounds && !exact; ++round) {
    choose();
    for (int step = 0; step < kSteps; ++step) improve(best, fit_curve(best, samples), samples);
  }
  return choose() < kEnough;
}

bool fit_axis(const KnownAxes& known, std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
              HeightModel& model) {
  double axis[3];
  return find_axis(known, samples, first, axis) && quantise({axis[0], axis[1], axis[2]}, samples, model);
}

void fit_knots(const std::vector<ColourHeight>& sorted, HeightModel& model) {
  HatFunctions hats;
  for (size_t i = 0; i < sorted.size(); ++i)
    hats.add(sorted[i].mean() / 256, static_cast<double>(i), static_cast<double>(sorted[i].pixels));
  double knots[HeightModel::kKnots];
  hats.solve(0.05, knots);
  for (int i = 0; i < HeightModel::kKnots; ++i)
    model.knots[i] =
        static_cast<int16_t>(std::lround(std::clamp(knots[i], 0.0, static_cast<double>(sorted.size() - 1)) * 16));
}

}  // namespace telesplat::codec::detail
