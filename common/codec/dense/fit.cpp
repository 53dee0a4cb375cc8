#include "common/codec/dense/fit.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace telesplat::codec::detail {
namespace {

// A x = b for symmetric positive A of n x n, in place; false where it is singular. Cholesky's method.
template <int kN>
struct Cholesky {
  double a[kN][kN];
  int n = kN;
  bool factor() {
    for (int j = 0; j < n; ++j) {
      double d = a[j][j];
      for (int k = 0; k < j; ++k) d -= a[j][k] * a[j][k];
      if (!(d > 0)) return false;
      a[j][j] = std::sqrt(d);
      for (int i = j + 1; i < n; ++i) {
        double s = a[i][j];
        for (int k = 0; k < j; ++k) s -= a[i][k] * a[j][k];
        a[i][j] = s / a[j][j];
      }
    }
    return true;
  }
  void solve(double* b) const {
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
      b[i] /= a[i][i];
    }
    for (int i = n; i-- > 0;) {
      for (int k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
      b[i] /= a[i][i];
    }
  }
};

constexpr size_t kSlopes = 400;  // that are looked at

struct Slope {
  double h[3];  // slopes and height, as geometry() has them
  double n[3];  // unit normal
};

// The same numbers as in geometry(), but for the last shift.
bool slope_at(const Plane<uint32_t>& depth, int x, int y, int x0, int y0, int shift, double h[3]) {
  const uint32_t* const row = depth.row(y);
  const int u = static_cast<int>(row[x + 1] - row[x - 1]) >> shift,
            v = static_cast<int>(depth.row(y + 1)[x] - depth.row(y - 1)[x]) >> shift;
  if (std::abs(u) > 32767 || std::abs(v) > 32767) return false;
  h[0] = u, h[1] = v;
  h[2] = static_cast<double>(static_cast<int>(row[x] << 1) >> shift) - double(x + x0) * u - double(y + y0) * v;
  return true;
}

using Vector9 = double[9];

// The matrix, as a vector, that maximises how much of A h lies along n against how much lies across.
bool best_matrix(const std::vector<Slope>& slopes, const std::vector<double>& weights, size_t every, Vector9 out) {
  double along[9][9] = {}, all[3][3] = {}, across_scale = 0;
  Cholesky<9> across{};
  for (size_t s = 0; s < slopes.size(); s += every) {
    const Slope& k = slopes[s];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) {
        const double hh = weights[s] * k.h[i] * k.h[j];
        all[i][j] += hh;
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b) along[3 * a + i][3 * b + j] += hh * k.n[a] * k.n[b];
      }
  }
  for (int a = 0; a < 9; ++a)
    for (int b = 0; b < 9; ++b) {
      const int i = a % 3, j = b % 3;
      if (i < j) along[a][b] = along[b / 3 * 0 + (a / 3) * 3 + j][(b / 3) * 3 + i];
    }
  for (int a = 0; a < 9; ++a)
    for (int b = 0; b < 9; ++b) {
      const int i = a % 3, j = b % 3;
      across.a[a][b] = (a / 3 == b / 3 ? all[std::max(i, j)][std::min(i, j)] : 0) - along[a][b];
      if (a == b) across_scale += across.a[a][b];
    }
  for (int a = 0; a < 9; ++a) across.a[a][a] += across_scale * 1e-7 + 1e-12;
  if (!across.factor()) return false;
  Vector9 v = {1, 0.3, 0.2, 0.1, 1, 0.4, 0.2, 0.3, 1};
  for (int round = 0; round < 12; ++round) {
    Vector9 next = {};
    for (int a = 0; a < 9; ++a)
      for (int b = 0; b < 9; ++b) next[a] += along[a][b] * v[b];
    across.solve(next);
    double size = 0;
    for (const double e : next) size += e * e;
    if (!(size > 0) || !std::isfinite(size)) return false;
    for (int a = 0; a < 9; ++a) v[a] = next[a] / std::sqrt(size);
  }
  std::copy_n(v, 9, out);
  return true;
}

// n . A h / |A h| of each; its sum.
double agreement(const std::vector<Slope>& slopes, const Vector9 m, std::vector<double>& out) {
  double sum = 0;
  out.resize(slopes.size());
  for (size_t s = 0; s < slopes.size(); ++s) {
    double dot = 0, square = 1e-30;
    for (int a = 0; a < 3; ++a) {
      const double e = m[3 * a] * slopes[s].h[0] + m[3 * a + 1] * slopes[s].h[1] + m[3 * a + 2] * slopes[s].h[2];
      dot += e * slopes[s].n[a], square += e * e;
    }
    sum += out[s] = dot / std::sqrt(square);
  }
  return sum;
}

bool all_same(const Samples& samples, const Plane<int16_t>& plane) {
  const int16_t value = plane.row(samples.places[0].y)[samples.places[0].x];
  return std::all_of(samples.places.begin(), samples.places.end(),
                     [&](const Samples::Place& p) { return plane.row(p.y)[p.x] == value; });
}

int shift_for(double size, double most) {
  int shift = 0;
  while (size > most && shift < 15) size /= 2, ++shift;
  return shift;
}

// Doubles -> integers of the sum that geometry() allows.
bool quantise(const Vector9 m, const double scale[3], GeometryModel& model) {
  double total = 0, value[9];
  for (int a = 0; a < 9; ++a) total += std::abs(value[a] = m[a] / scale[a % 3]);
  if (!(total > 0) || !std::isfinite(total)) return false;
  for (int a = 0; a < 9; ++a)
    model.matrix[a / 3][a % 3] = static_cast<int16_t>(std::lround(value[a] * (kMostMatrix - 16) / total));
  return true;
}

constexpr size_t kLeastSlopes = 32;

// The size that nine of ten do not exceed.
double nine_of_ten(std::vector<double>& sizes) {
  const auto at = sizes.begin() + static_cast<ptrdiff_t>(sizes.size() * 9 / 10);
  std::nth_element(sizes.begin(), at, sizes.end());
  return *at;
}

// The shift by which nine of ten slopes fit; of every so many samples.
int slope_shift_of(const Samples& samples, const Plane<uint32_t>& depth, size_t every, std::vector<double>& sizes) {
  sizes.clear();
  for (size_t i = 0; i < samples.places.size(); i += std::max<size_t>(1, every)) {
    const auto p = samples.places[i];
    const uint32_t* const row = depth.row(p.y);
    sizes.push_back(std::max(std::abs(double(static_cast<int>(row[p.x + 1] - row[p.x - 1]))),
                             std::abs(double(static_cast<int>(depth.row(p.y + 1)[p.x] - depth.row(p.y - 1)[p.x])))));
  }
  return shift_for(nine_of_ten(sizes) * 2, 32767);
}

// Those that are not too large, of every so many samples.
std::vector<Slope> slopes_of(const Samples& samples, const Plane<uint32_t>& depth,
                             const Plane<int16_t>* const normal[2], int x0, int y0, int shift, size_t every) {
  std::vector<Slope> slopes;
  for (size_t i = 0; i < samples.places.size(); i += std::max<size_t>(1, every)) {
    const auto p = samples.places[i];
    Slope s;
    if (!slope_at(depth, p.x, p.y, x0, y0, shift, s.h)) continue;
    const int cx = normal[0]->row(p.y)[p.x] / 64 - 127, cy = normal[1]->row(p.y)[p.x] / 64 - 127;
    const int cz = 127 - std::abs(cx) - std::abs(cy), fold = std::max(-cz, 0);
    const double x = cx + (cx >= 0 ? -fold : fold), y = cy + (cy >= 0 ? -fold : fold), z = cz;
    const double length = std::sqrt(x * x + y * y + z * z);
    s.n[0] = x / length, s.n[1] = y / length, s.n[2] = z / length;
    slopes.push_back(s);
  }
  return slopes;
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

bool fit_geometry(const Samples& samples, const Plane<uint32_t>& depth, const Plane<int16_t>* const normal[2], int x0,
                  int y0, GeometryModel& model) {
  if (samples.places.size() < kLeastSlopes || (all_same(samples, *normal[0]) && all_same(samples, *normal[1])))
    return false;
  std::vector<double> sizes;
  model.slope_shift = slope_shift_of(samples, depth, 1, sizes);
  std::vector<Slope> slopes =
      slopes_of(samples, depth, normal, x0, y0, model.slope_shift, samples.places.size() / kSlopes);
  double most[3] = {1, 1, 1};
  if (slopes.size() < kLeastSlopes) return false;
  double scale[3];
  for (int i = 0; i < 3; ++i) {
    sizes.clear();
    for (const Slope& s : slopes) sizes.push_back(std::abs(s.h[i]));
    most[i] = std::max(1.0, nine_of_ten(sizes));
    scale[i] = most[i];
  }
  model.height_shift = shift_for(most[2] * 2, 32767);
  std::vector<double> weights(slopes.size()), dots;
  for (size_t i = 0; i < slopes.size(); ++i) {
    double square = 0;
    for (int j = 0; j < 3; ++j) slopes[i].h[j] /= scale[j], square += slopes[i].h[j] * slopes[i].h[j];
    weights[i] = 1 / (square + 1e-3);
  }
  const std::vector<double> even = weights;
  Vector9 m;
  if (!best_matrix(slopes, weights, 2, m)) return false;
  for (int round = 0; round < 2; ++round) {  // once more, without those that disagree
    if (agreement(slopes, m, dots) < 0)
      for (double& e : m) e = -e;
    agreement(slopes, m, dots);
    for (size_t i = 0; i < slopes.size(); ++i) weights[i] = even[i] / (1 + 400 * std::max(0.0, 1 - dots[i]));
    if (!best_matrix(slopes, weights, round == 0 ? 2 : 1, m)) return false;
  }
  if (agreement(slopes, m, dots) < 0)
    for (double& e : m) e = -e;
  const double shifted[3] = {scale[0], scale[1], scale[2] / std::pow(2.0, model.height_shift)};
  return quantise(m, shifted, model);
}

bool known_geometry(const Samples& samples, const Plane<uint32_t>& depth, const Plane<int16_t>* const normal[2], int x0,
                    int y0, const double matrix[9], GeometryModel& model) {
  constexpr size_t kEnough = 100;      // slopes
  constexpr double kLeastAgree = 0.7;  // mean cosine
  if (samples.places.size() < kLeastSlopes) return false;
  const size_t every = samples.places.size() / kEnough;
  std::vector<double> sizes, dots;
  model.slope_shift = slope_shift_of(samples, depth, every, sizes);
  const std::vector<Slope> slopes = slopes_of(samples, depth, normal, x0, y0, model.slope_shift, every);
  if (!(agreement(slopes, matrix, dots) > kLeastAgree * static_cast<double>(slopes.size()))) return false;
  sizes.clear();
  for (const Slope& s : slopes) sizes.push_back(std::abs(s.h[2]));
  model.height_shift = shift_for(std::max(1.0, nine_of_ten(sizes)) * 2, 32767);
  const double scale[3] = {1, 1, std::pow(2.0, -model.height_shift)};
  return quantise(matrix, scale, model);
}

namespace {

constexpr int kTerms = kFeatures;  // 13 differences from the guide at the pixel, the residual, 1, and what is wanted
constexpr int kUnknown = 14, kWanted = 14;
constexpr int kRounds = 3, kRoughRounds = 1;  // of which the first, and what comes before, take half of the samples

struct Features {
  float of[kTerms];
};

void set_features(Features& out, const Plane<int16_t>& own, const Plane<int16_t>& left, const Plane<int16_t>& guide,
                  const Plane<int16_t>* residual, int x, int y) {
  const int16_t *row = own.row(y) + x, *up = own.row(y - 1) + x;
  const int16_t *g0 = guide.row(y - 1) + x, *g1 = guide.row(y) + x, *g2 = guide.row(y + 1) + x;
  const int c = g1[0];
  const auto off = [c](int16_t value) { return static_cast<float>(value - c); };
  out = {off(left.row(y)[x - 1]),
         off(up[0]),
         off(up[-1]),
         off(up[1]),
         off(g0[-1]),
         off(g0[0]),
         off(g0[1]),
         off(g1[-1]),
         off(g1[1]),
         off(g2[-1]),
         off(g2[0]),
         off(g2[1]),
         residual != nullptr ? static_cast<float>(residual->row(y)[x]) : 0,
         64,
         off(row[0]),
         0};
}

// How far off a solution is, whose last terms are -1 and 0, in one sample. In four parts, as vectors have them.
float miss(const Features& f, const float solution[kTerms]) {
  float parts[4] = {};
  for (int i = 0; i < kTerms; i += 4)
    for (int k = 0; k < 4; ++k) parts[k] += solution[i + k] * f.of[i + k];
  return (parts[0] + parts[1]) + (parts[2] + parts[3]);
}

// Weighted least squares; false where the system is singular.
bool solve_weighted(const std::vector<Features>& all, const std::vector<float>& weights, size_t n,
                    double solution[kUnknown]) {
  alignas(64) float sums[kTerms][kTerms];
  kernels().normal_equations(&all[0].of, weights.data(), n, sums);
  Cholesky<kUnknown> system{};
  double trace = 0;
  for (int i = 0; i < kUnknown; ++i) trace += static_cast<double>(sums[i][i]);
  for (int i = 0; i < kUnknown; ++i) {
    for (int j = 0; j < kUnknown; ++j) system.a[i][j] = static_cast<double>(sums[std::max(i, j)][std::min(i, j)]);
    system.a[i][i] += trace * 1e-6 + 1e-9;
    solution[i] = static_cast<double>(sums[kWanted][i]);
  }
  if (!system.factor()) return false;
  system.solve(solution);
  return true;
}

// The differences' weights as those of the values themselves; false where they are too large.
bool quantise_weights(const double solution[kUnknown], int16_t weights[kGuidedTerms], int32_t& constant) {
  static constexpr int kPlaces[13] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13};
  int total = 0, sum = 0;
  for (int i = 0; i < 13; ++i) {
    if (!(std::abs(solution[i]) < 3.9)) return false;
    weights[kPlaces[i]] = static_cast<int16_t>(std::lround(solution[i] * 8192));
    total += std::abs(weights[kPlaces[i]]);
    if (i < 12) sum += weights[kPlaces[i]];
  }
  if (total + std::abs(8192 - sum) > kMostWeight || std::abs(8192 - sum) > 32767) return false;
  weights[8] = static_cast<int16_t>(8192 - sum);
  constant = static_cast<int32_t>(std::lround(std::clamp(solution[13], -3.0, 3.0) * 64 * 8192));
  return true;
}

// How much predictions leave: the sum of some samples' tokens, which grow as bits do. off(f): how far one is off.
template <class Off>
uint64_t tokens_left(const std::vector<Features>& all, size_t n, int bits, Off off) {
  const float scale = 2 / static_cast<float>(1 << bits);
  uint64_t sum = 0;
  for (size_t s = 0; s < n; s += 3)
    sum += token_of(static_cast<uint32_t>(std::min(std::abs(off(all[s])) * scale, 1e6f)));
  return sum;
}

float median_off(const Features& f) {
  const float low = std::min(f.of[0], f.of[1]), high = std::max(f.of[0], f.of[1]);
  return std::clamp(f.of[0] + f.of[1] - f.of[2], low, high) - f.of[kWanted];
}

}  // namespace

bool fit_guided(const Samples& samples, const Plane<int16_t>& own, const Plane<int16_t>& guide,
                const Plane<int16_t>* residual, int bits, int16_t weights[kGuidedTerms], int32_t& constant,
                const Plane<int16_t>* left, double& left_over) {
  const size_t n = samples.places.size();
  left_over = std::numeric_limits<double>::infinity();
  if (n < 64) return false;
  if (all_same(samples, own)) {
    left_over = 0;
    return false;
  }
  static thread_local std::vector<Features> all;
  static thread_local std::vector<float> shares;
  if (all.size() < n + 3) all.resize(n + 3), shares.resize(n + 3);  // to a multiple of four
  const size_t few = n / 2;                                         // the first rounds need not be exact
  for (size_t s = 0; s < n; ++s) {
    const auto p = samples.places[s < few ? 2 * s : std::min(2 * (s - few) + 1, n - 1)];
    set_features(all[s], own, left != nullptr ? *left : own, guide, residual, p.x, p.y);
    if (s >= few) continue;  // theirs follow from what is found first
    const float* const f = all[s].of;
    const float near = 64 + std::abs(f[kWanted] - f[0]) + std::abs(f[kWanted] - f[1]) + std::abs(f[kWanted]) / 4;
    shares[s] = 1 / (near * near);
  }
  double solution[kUnknown];
  bool solved = solve_weighted(all, shares, few, solution);
  for (int round = 0; solved && round < kRounds; ++round) {  // towards the median, at last beyond it
    float terms[kTerms] = {};
    for (int i = 0; i < kUnknown; ++i) terms[i] = static_cast<float>(solution[i]);
    terms[kWanted] = -1;
    const bool last = round + 1 == kRounds;
    const size_t count = round < kRoughRounds ? few : n;
    kernels().sample_shares(&all[0].of, terms, count, last ? 64 : 24, last, shares.data());
    solved = solve_weighted(all, shares, count, solution);
  }
  if (solved && left == nullptr) {
    float terms[kTerms] = {};
    for (int i = 0; i < kUnknown; ++i) terms[i] = static_cast<float>(solution[i]);
    terms[kWanted] = -1;
    const uint64_t fitted = tokens_left(all, n, bits, [&](const Features&f) { return miss(f, terms); }),
                   median = tokens_left(all, n, bits, median_off);
    solved = fitted < median;
    left_over = 3 * static_cast<double>(std::min(fitted, median)) / static_cast<double>(n);
  }
  std::fill_n(weights, kGuidedTerms, int16_t{0});
  return solved && quantise_weights(solution, weights, constant);
}

namespace {

// Features by flatness: LL and UU stand where the constant and what is wanted stand else; what is wanted, less the
// constant, is the last.
constexpr int kFlatTerms = 15, kFlatWanted = 15;
constexpr int kFlatPlaces[kFlatTerms] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, kOtherResidual, kFarLeft, kFarAbove};
constexpr int kFlatStep = 128;  // of a weight's difference, in 2^-13
constexpr int kFlatRounds = 2;
constexpr double kPriorSamples = 0.3;  // how many samples say that a flatness has the weights of all

struct FlatFit {
  std::vector<Features> all;  // by flatness
  std::vector<float> shares;
  size_t begin[kFlatnesses + 1] = {};
  double prior[kFlatTerms];
  size_t count(int k) const { return begin[k + 1] - begin[k]; }
};

void load_samples(FlatFit& fit, const FlatSamples& by, const Plane<int16_t>& own, const Plane<int16_t>& guide,
                  const Plane<int16_t>* residual, int32_t constant) {
  const auto flatness = [&](const Samples::Place& p) { return by.flatness->row(p.y)[p.x]; };
  for (const auto& p : by.samples.places) ++fit.begin[flatness(p) + 1];
  for (int k = 0; k < kFlatnesses; ++k) fit.begin[k + 1] += fit.begin[k];
  size_t at[kFlatnesses];
  std::copy_n(fit.begin, kFlatnesses, at);
  fit.all.resize(by.samples.places.size() + 3), fit.shares.resize(by.samples.places.size() + 3);
  for (const auto& p : by.samples.places) {
    Features& f = fit.all[at[flatness(p)]++];
    set_features(f, own, own, guide, residual, p.x, p.y);
    const auto c = static_cast<float>(guide.row(p.y)[p.x]);
    f.of[kFlatWanted] = f.of[kWanted] - static_cast<float>(constant) / 8192;
    f.of[13] = static_cast<float>(own.row(p.y)[p.x - 2]) - c;
    f.of[14] = static_cast<float>(own.row(p.y - 2)[p.x]) - c;
  }
}

constexpr float kNear = 24;  // in 64ths of a code

// Shares of the samples of one flatness by what a solution misses.
void find_shares(FlatFit& fit, int k, const double solution[kFlatTerms], bool last) {
  alignas(64) float terms[kTerms];
  for (int i = 0; i < kFlatTerms; ++i) terms[i] = static_cast<float>(solution[i]);
  terms[kFlatWanted] = -1;
  kernels().sample_shares(&fit.all[fit.begin[k]].of, terms, fit.count(k), last ? 64 : kNear, last, fit.shares.data());
}

// The sums of its equations, too.
void weigh_samples(FlatFit& fit, int k, const double solution[kFlatTerms], bool last, float sums[kTerms][kTerms]) {
  find_shares(fit, k, solution, last);
  kernels().normal_equations(&fit.all[fit.begin[k]].of, fit.shares.data(), fit.count(k), sums);
}

bool solve_flat(const FlatFit& fit, int k, const float sums[kTerms][kTerms], double solution[kFlatTerms]) {
  Cholesky<kFlatTerms> system{};
  for (int i = 0; i < kFlatTerms; ++i) {
    for (int j = 0; j < kFlatTerms; ++j) system.a[i][j] = static_cast<double>(sums[std::max(i, j)][std::min(i, j)]);
    const double strength = system.a[i][i] * kPriorSamples / static_cast<double>(fit.count(k)) + 1e-9;
    system.a[i][i] += strength;
    solution[i] = static_cast<double>(sums[kFlatWanted][i]) + strength * fit.prior[i];
  }
  if (!system.factor()) return false;
  system.solve(solution);
  return true;
}

double token_of_miss(float off) { return token_of(static_cast<uint32_t>(std::min(off / 32, 1e6f))); }

// The sum of the tokens that a solution leaves of one flatness.
double tokens_of(FlatFit& fit, int k, const double solution[kFlatTerms]) {
  find_shares(fit, k, solution, false);
  double sum = 0;
  for (size_t s = 0; s < fit.count(k); ++s) sum += token_of_miss(1 / fit.shares[s] - kNear);
  return sum;
}

double median_tokens(const FlatFit& fit, int k) {
  double sum = 0;
  for (size_t s = fit.begin[k]; s < fit.begin[k + 1]; ++s) {
    const Features& f = fit.all[s];
    const float low = std::min(f.of[0], f.of[1]), high = std::max(f.of[0], f.of[1]);
    sum += token_of_miss(std::abs(std::clamp(f.of[0] + f.of[1] - f.of[2], low, high) - f.of[kFlatWanted]));
  }
  return sum;
}

int steps_of(double off) { return static_cast<int>(std::lround(std::clamp(off, -3.9, 3.9) * 8192 / kFlatStep)); }

// What a flatness says of neighbours on the same facet: the mean of L + U - UL, 2 L - LL and 2 U - UU, as far as depth
// agrees with them.
void predict_by_facet(int flatness, double solution[kFlatTerms]) {
  std::fill_n(solution, kFlatTerms, 0.0);
  const double share = 1.0 / std::popcount(static_cast<unsigned>(flatness));
  if (flatness & 1) solution[0] += share, solution[1] += share, solution[2] -= share;
  if (flatness & 2) solution[0] += 2 * share, solution[13] -= share;
  if (flatness & 4) solution[1] += 2 * share, solution[14] -= share;
}

bool add_weights_of(const int16_t weights[kGuidedTerms], const int16_t steps[kGuidedTerms], int16_t out[kGuidedTerms]) {
  int total = 0, guide = weights[kGuideHere];
  for (const int place : kFlatPlaces) {
    const int off = steps[place] * kFlatStep, w = weights[place] + off;
    if (std::abs(w) > 32767) return false;
    out[place] = static_cast<int16_t>(w);
    total += std::abs(w);
    if (place != kOtherResidual) guide -= off;
  }
  out[kGuideHere] = static_cast<int16_t>(guide);
  return std::abs(guide) <= 32767 && total + std::abs(guide) <= kMostWeight;
}

// Weights of one flatness, from those of all, which leave tokens of the sum `by_all`, or from what it says of facets;
// as differences to those of all. Returns what they leave.
double fit_flatness(FlatFit& fit, int k, double by_all, const int16_t weights[kGuidedTerms],
                    int16_t out[kGuidedTerms]) {
  std::fill_n(out, kGuidedTerms, int16_t{0});
  if (fit.count(k) == 0) return 0;
  double left = by_all, trial[kFlatTerms], best[kFlatTerms];
  std::copy_n(fit.prior, kFlatTerms, best);
  const auto consider = [&] {
    int16_t steps[kGuidedTerms] = {}, sums[kGuidedTerms];
    for (int i = 0; i < kFlatTerms; ++i) {
      steps[kFlatPlaces[i]] = static_cast<int16_t>(steps_of(trial[i] - fit.prior[i]));
      trial[i] = fit.prior[i] + static_cast<double>(steps[kFlatPlaces[i]]) * kFlatStep / 8192;
    }
    if (!add_weights_of(weights, steps, sums)) return;
    const double tokens = tokens_of(fit, k, trial);
    if (tokens < left) left = tokens, std::copy_n(trial, kFlatTerms, best), std::copy_n(steps, kGuidedTerms, out);
  };
  if (k != 0) predict_by_facet(k, trial), consider();
  std::copy_n(best, kFlatTerms, trial);
  alignas(64) float sums[kTerms][kTerms];
  for (int round = 0; round < kFlatRounds; ++round) {
    weigh_samples(fit, k, trial, round + 1 == kFlatRounds, sums);
    if (!solve_flat(fit, k, sums, trial)) return left;
    consider();
  }
  return left;
}

}  // namespace

bool add_flat_weights(const int16_t weights[kGuidedTerms], const FlatWeights& flat,
                      int16_t out[kFlatnesses][kGuidedTerms]) {
  for (int k = 0; k < kFlatnesses; ++k)
    if (!add_weights_of(weights, flat.off[k], out[k])) return false;
  return true;
}

bool fit_flat_weights(const FlatSamples& by, const Plane<int16_t>& own, const Plane<int16_t>& guide,
                      const Plane<int16_t>* residual, const int16_t weights[kGuidedTerms], int32_t constant,
                      bool median, size_t pixels, FlatWeights& out) {
  const size_t n = by.samples.places.size();
  if (n < 256 || all_same(by.samples, own)) return false;
  FlatFit fit;
  load_samples(fit, by, own, guide, residual, constant);
  for (int i = 0; i < kFlatTerms; ++i) fit.prior[i] = weights[kFlatPlaces[i]] / 8192.0;
  double before = 0, after = 0, cost = 0;
  for (int k = 0; k < kFlatnesses; ++k) {
    const double by_all = tokens_of(fit, k, fit.prior);
    before += median ? median_tokens(fit, k) : by_all;
    after += fit_flatness(fit, k, by_all, weights, out.off[k]);
    for (const int place : kFlatPlaces) cost += 1.5 + 2 * std::log2(1.0 + std::abs(out.off[k][place]));
  }
  return (before - after) / 8 * static_cast<double>(pixels) / static_cast<double>(n) > 1.5 * cost;
}

}  // namespace telesplat::codec::detail
