#include "common/codec/dense/height.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace telesplat::codec::detail {
namespace {

constexpr int kBins = HeightModel::kKnots - 1;

struct Axis {
  double a, b, c;
  double of(const HeightSample& s) const { return (a * double{s.x} + b * double{s.y} + c) / double{s.code}; }
};

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

// The palette in the order of its colours' heights.
void sort_palette(const Axis& axis, const std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
                  std::vector<uint32_t>& palette, std::vector<uint32_t>& place) {
  std::vector<double> sum(palette.size()), count(palette.size(), 1);
  for (size_t i = 0; i < palette.size(); ++i) sum[i] = axis.of(first[i]);
  for (const HeightSample& s : samples) sum[s.index] += axis.of(s), count[s.index] += 1;
  std::vector<uint32_t> order(palette.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t i, uint32_t j) {
    const double a = sum[i] / count[i], b = sum[j] / count[j];
    return a != b ? a < b : palette[i] < palette[j];
  });
  std::vector<uint32_t> sorted(palette.size());
  place.resize(palette.size());
  for (size_t i = 0; i < order.size(); ++i) sorted[i] = palette[order[i]], place[order[i]] = static_cast<uint32_t>(i);
  palette = sorted;
}

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
  // Least squares of hat functions: a tridiagonal system, which a little smoothness makes regular.
  double diagonal[HeightModel::kKnots], side[HeightModel::kKnots] = {}, right[HeightModel::kKnots] = {};
  std::fill_n(diagonal, HeightModel::kKnots, 1e-6);
  for (size_t n = 0; n < samples.size(); ++n) {
    const double t = std::clamp((heights[n] - curve.low) / curve.step, 0.0, kBins - 1e-9);
    const int i = static_cast<int>(t);
    const double f = t - i, value = samples[n].index;
    diagonal[i] += (1 - f) * (1 - f), diagonal[i + 1] += f * f, side[i] += f * (1 - f);
    right[i] += (1 - f) * value, right[i + 1] += f * value;
  }
  for (int i = 0; i < kBins; ++i) diagonal[i] += 0.05, diagonal[i + 1] += 0.05, side[i] -= 0.05;
  for (int i = 1; i < HeightModel::kKnots; ++i) {
    const double f = side[i - 1] / diagonal[i - 1];
    diagonal[i] -= f * side[i - 1], right[i] -= f * right[i - 1];
  }
  for (int i = HeightModel::kKnots; i-- > 0;)
    curve.knots[i] = (right[i] - (i + 1 < HeightModel::kKnots ? side[i] * curve.knots[i + 1] : 0)) / diagonal[i];
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
  for (int i = 0; i < 3; ++i) m[i][i] *= 1 + 1e-4;
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(m[i][i]) > 0)) return;
    for (int k = i + 1; k < 3; ++k) {
      const double f = m[k][i] / m[i][i];
      for (int j = i; j < 4; ++j) m[k][j] -= f * m[i][j];
    }
  }
  double d[3];
  for (int i = 3; i-- > 0;) {
    d[i] = m[i][3];
    for (int j = i + 1; j < 3; ++j) d[i] -= m[i][j] * d[j];
    d[i] /= m[i][i];
    if (!std::isfinite(d[i])) return;
  }
  axis.a += d[0], axis.b += d[1], axis.c += d[2];
}

// The axis and the curve in the integers of heights().
bool quantise(const Axis& axis, const Curve& curve, const std::vector<HeightSample>& samples, size_t colours,
              HeightModel& model) {
  double most = 0, far = 1;
  for (const HeightSample& s : samples) {
    most = std::max(most, std::abs(axis.of(s)));
    far = std::max(far, std::abs(double{s.x}) + std::abs(double{s.y}));
  }
  const double unit = 0.99 / std::max(most, 1e-12);  // quotients lie within 1
  const double limit = static_cast<double>(1 << 26);
  const double terms[3] = {axis.a * unit, axis.b * unit, axis.c * unit};
  if (!(std::abs(terms[0]) * far < limit && std::abs(terms[1]) * far < limit && std::abs(terms[2]) < limit))
    return false;
  model.a = static_cast<int32_t>(std::lround(terms[0]));
  model.b = static_cast<int32_t>(std::lround(terms[1]));
  model.c = static_cast<int32_t>(std::lround(terms[2]));
  const double low = curve.low * unit * 16384, range = curve.step * kBins * unit * 16384;
  model.low = static_cast<int32_t>(std::floor(low));
  model.scale =
      static_cast<int32_t>(std::clamp(std::floor(16383 * 4096.0 / std::max(range + 1, 1025.0)), 1.0, 65535.0));
  for (int i = 0; i < HeightModel::kKnots; ++i) {
    const double s = (model.low + i * 256 * 4096.0 / model.scale) / 16384 / unit;
    model.knots[i] =
        static_cast<int16_t>(std::lround(std::clamp(curve.at(s), 0.0, static_cast<double>(colours - 1)) * 16));
  }
  return true;
}

}  // namespace

bool rays_of(const GeometryModel& g, double rays[3][3]) {
  double m[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][j] = j == 2 ? g.matrix[i][j] / std::pow(2.0, g.height_shift) : g.matrix[i][j];
  // The inverse's transpose: cofactors.
  double determinant = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      rays[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
      if (i == 0) determinant += m[i][j] * rays[i][j];
    }
  if (!(std::abs(determinant) > 0)) return false;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rays[i][j] /= determinant;
  return true;
}

bool fit_height(const double rays[3][3], std::vector<HeightSample>& samples, const std::vector<HeightSample>& first,
                std::vector<uint32_t>& palette, HeightModel& model) {
  if (samples.size() < 256 || palette.size() < 8) return false;
  Axis best{};
  double least = 1e300;
  for (int i = 0; i < 3; ++i) {
    const Axis axis{rays[i][0], rays[i][1], rays[i][2]};
    const double rough = roughness(axis, samples);
    if (rough < least) least = rough, best = axis;
  }
  const std::vector<uint32_t> unsorted = palette;
  std::vector<uint32_t> place;
  for (int round = 0; round < 2; ++round) {
    sort_palette(best, samples, first, palette, place);
    for (HeightSample& s : samples) s.index = place[s.index];
    improve(best, fit_curve(best, samples), samples);
    improve(best, fit_curve(best, samples), samples);
    std::vector<uint32_t> back(place.size());  // to the order of `first`
    for (uint32_t i = 0; i < place.size(); ++i) back[place[i]] = i;
    for (HeightSample& s : samples) s.index = back[s.index];
    palette = unsorted;
  }
  sort_palette(best, samples, first, palette, place);
  for (HeightSample& s : samples) s.index = place[s.index];
  const Curve curve = fit_curve(best, samples);
  double error = 0, spread = 0;
  for (const HeightSample& s : samples) {
    error += std::abs(curve.at(best.of(s)) - s.index);
    spread += std::abs(static_cast<double>(palette.size()) / 2 - s.index);
  }
  return error * 4 < spread && quantise(best, curve, samples, palette.size(), model);
}

}  // namespace telesplat::codec::detail
