#include "common/image/measures/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/image/srgb.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::image {
namespace {

constexpr double kPi = std::numbers::pi;

// Table 1 of the paper: CSF of a channel = a1 sqrt(pi / b1) exp(-pi^2 d^2 / b1) + the same with a2, b2; d in degrees.
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr Sensitivity kAchromatic{1, 0.0047, 0, 1e-5}, kRedGreen{1, 0.0053, 0, 1e-5},
    kBlueYellow{34.1, 0.04, 13.5, 0.025};
constexpr double kFeatureWidth_deg = 0.082;                                     // w: section 4.2
constexpr double kColourExponent = 0.7, kCompressAt = 0.4, kCompressTo = 0.95;  // q_c, p_c, p_t: section 4.1.3
constexpr double kFeatureExponent = 0.5;                                        // q_f

using Plane = std::vector<float>;
struct Colour {
  float x, y, z;
};

// Linear sRGB (D65) <-> XYZ relative to its white, so that white is (1, 1, 1).
constexpr double kWhite[3] = {0.950428545, 1.000000000, 1.088900371};
constexpr float over_white(double v, int row) { return static_cast<float>(v / kWhite[row]); }
constexpr float kToXyz[3][3] = {{over_white(0.412386564, 0), over_white(0.357591491, 0), over_white(0.180450490, 0)},
                                {over_white(0.212636822, 1), over_white(0.715182982, 1), over_white(0.072180196, 1)},
                                {over_white(0.019330620, 2), over_white(0.119197164, 2), over_white(0.950372587, 2)}};

constexpr std::array<std::array<float, 3>, 3> inverse(const float (&m)[3][3]) {
  std::array<std::array<float, 3>, 3> out{};
  double det = 0;
  const auto minor = [&](int r, int c) {
    const int r0 = (r + 1) % 3, r1 = (r + 2) % 3, c0 = (c + 1) % 3, c1 = (c + 2) % 3;
    return double(m[r0][c0]) * m[r1][c1] - double(m[r0][c1]) * m[r1][c0];
  };
  for (int c = 0; c < 3; ++c) det += double(m[0][c]) * minor(0, c);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[c][r] = static_cast<float>(minor(r, c) / det);
  return out;
}
constexpr auto kFromXyz = inverse(kToXyz);

template <class Matrix>
Colour times(const Matrix& m, const Colour& c) {
  return {m[0][0] * c.x + m[0][1] * c.y + m[0][2] * c.z, m[1][0] * c.x + m[1][1] * c.y + m[1][2] * c.z,
          m[2][0] * c.x + m[2][1] * c.y + m[2][2] * c.z};
}

// Opponent space: Yy = 116 Y - 16, Cx = 500 (X - Y), Cz = 200 (Y - Z).
Colour opponent(uint32_t code) {
  const auto& linear = linear_of_srgb();
  const Colour xyz = times(kToXyz, {linear[code >> 16 & 255], linear[code >> 8 & 255], linear[code & 255]});
  return {116 * xyz.y - 16, 500 * (xyz.x - xyz.y), 200 * (xyz.y - xyz.z)};
}

float lab_root(float t) {
  constexpr float kDelta = 6.0f / 29;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0f / 29;
}

// L*a*b* of linear RGB, a and b by Hunt's effect: colourfulness grows with luminance.
Colour hunt_lab(const Colour& rgb) {
  const Colour xyz = times(kToXyz, rgb);
  const float x = lab_root(xyz.x), y = lab_root(xyz.y), z = lab_root(xyz.z), lightness = 116 * y - 16;
  return {lightness, 0.01f * lightness * 500 * (x - y), 0.01f * lightness * 200 * (y - z)};
}

Colour lab_of_opponent(const Colour& c) {
  const float y = (c.x + 16) / 116;
  Colour rgb = times(kFromXyz, {y + c.y / 500, y, y - c.z / 200});
  for (float* v : {&rgb.x, &rgb.y, &rgb.z}) *v = std::clamp(*v, 0.0f, 1.0f);
  return hunt_lab(rgb);
}

float hyab(const Colour& a, const Colour& b) {
  return std::abs(a.x - b.x) + std::sqrt((a.y - b.y) * (a.y - b.y) + (a.z - b.z) * (a.z - b.z));
}

// Weights of a filter from -radius to radius along one axis.
using Taps = std::vector<float>;

// Gaussians of the CSFs are separable: a channel is a sum of `terms` separable filters, normalised over the square
// window.
std::vector<Taps> sensitivity_filters(const Sensitivity& s, int radius, double pixels_per_degree) {
  const auto axis = [&](double b) {
    std::vector<double> t(2 * radius + 1);
    for (int i = -radius; i <= radius; ++i) {
      const double d = i / pixels_per_degree;
      t[i + radius] = std::exp(-kPi * kPi * d * d / b);
    }
    return t;
  };
  const auto total = [](const std::vector<double>& t) {
    double sum = 0;
    for (double v : t) sum += v;
    return sum * sum;
  };
  std::vector<std::pair<double, std::vector<double>>> terms;
  for (const auto& [a, b] : {std::pair{s.a1, s.b1}, {s.a2, s.b2}})
    if (a > 0) terms.emplace_back(a * std::sqrt(kPi / b), axis(b));
  double sum = 0;
  for (const auto& [weight, t] : terms) sum += weight * total(t);
  std::vector<Taps> out;
  for (const auto& [weight, t] : terms) {
    Taps taps;
    for (double v : t) taps.push_back(static_cast<float>(v * std::sqrt(weight / sum)));  // used along both axes
    out.push_back(std::move(taps));
  }
  return out;
}

struct FeatureFilters {
  Taps smooth, edge, point;  // Gaussian, and its derivatives; their positive and negative parts each sum to 1
};

FeatureFilters feature_filters(double pixels_per_degree) {
  const double sigma = 0.5 * kFeatureWidth_deg * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> g, first, second;
  for (int i = -radius; i <= radius; ++i) {
    const double v = std::exp(-i * i / (2 * sigma * sigma));
    g.push_back(v);
    first.push_back(-i * v);
    second.push_back((i * i / (sigma * sigma) - 1) * v);
  }
  const auto normalised = [](const std::vector<double>& t) {
    double positive = 0, negative = 0;
    for (double v : t) (v > 0 ? positive : negative) += std::abs(v);
    Taps out;
    for (double v : t) {
      const double scale = v > 0 ? positive : negative;
      out.push_back(static_cast<float>(scale > 0 ? v / scale : 0.0));
    }
    return out;
  };
  return {normalised(g), normalised(first), normalised(second)};
}

void for_rows(int height, const auto& body) {
  in_parallel(tbb::blocked_range<int>(0, height, 8), [&](const tbb::blocked_range<int>& range) {
    for (int y = range.begin(); y < range.end(); ++y) body(y);
  });
}

/// Separable filtering that repeats the border's pixels.
class Filter {
 public:
  Filter(int width, int height) : width_(width), height_(height) {}

  /// out (+)= in filtered with `across` along x and `down` along y.
  void apply(const Plane& in, const Taps& across, const Taps& down, Plane& out, bool add = false) const {
    const int rx = static_cast<int>(across.size()) / 2, ry = static_cast<int>(down.size()) / 2;
    Plane middle(in.size());
    for_rows(height_, [&](int y) {
      std::vector<float> line(size_t(width_) + 2 * rx);
      const float* row = &in[size_t(y) * width_];
      std::fill_n(line.begin(), rx, row[0]);
      std::copy_n(row, width_, line.begin() + rx);
      std::fill_n(line.end() - rx, rx, row[width_ - 1]);
      float* __restrict to = &middle[size_t(y) * width_];
      std::fill_n(to, width_, 0.0f);
      for (int k = 0; k <= 2 * rx; ++k) {
        const float* from = line.data() + k;
        const float w = across[k];
        for (int x = 0; x < width_; ++x) to[x] += w * from[x];
      }
    });
    out.resize(in.size());
    for_rows(height_, [&](int y) {
      float* __restrict to = &out[size_t(y) * width_];
      if (!add) std::fill_n(to, width_, 0.0f);
      for (int k = -ry; k <= ry; ++k) {
        const float* from = &middle[size_t(std::clamp(y + k, 0, height_ - 1)) * width_];
        const float w = down[k + ry];
        for (int x = 0; x < width_; ++x) to[x] += w * from[x];
      }
    });
  }

 private:
  int width_, height_;
};

// A picture in the form that the comparison needs.
struct Perceived {
  std::vector<Colour> lab;  // filtered, Hunt-adjusted
  Plane edges, points;      // magnitudes
};

Perceived perceive(const View& view, double pixels_per_degree) {
  const int width = view.width, height = view.height;
  const size_t pixels = size_t(width) * height;
  Plane channels[3] = {Plane(pixels), Plane(pixels), Plane(pixels)}, luminance(pixels);
  for_rows(height, [&](int y) {
    for (size_t i = size_t(y) * width, end = i + width; i < end; ++i) {
      const Colour c = opponent(view.colour[i]);
      channels[0][i] = c.x, channels[1][i] = c.y, channels[2][i] = c.z;
      luminance[i] = (c.x + 16) / 116;
    }
  });

  const Filter filter(width, height);
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(kBlueYellow.b1 / (2 * kPi * kPi)) * pixels_per_degree));
  const Sensitivity* sensitivities[3] = {&kAchromatic, &kRedGreen, &kBlueYellow};
  for (int c = 0; c < 3; ++c) {
    Plane filtered;
    bool add = false;
    for (const Taps& taps : sensitivity_filters(*sensitivities[c], radius, pixels_per_degree)) {
      filter.apply(channels[c], taps, taps, filtered, add);
      add = true;
    }
    channels[c] = std::move(filtered);
  }

  const FeatureFilters f = feature_filters(pixels_per_degree);
  Perceived out{std::vector<Colour>(pixels), Plane(pixels), Plane(pixels)};
  Plane dx, dy;
  for (const auto& [taps, magnitude] : {std::pair{&f.edge, &out.edges}, {&f.point, &out.points}}) {
    filter.apply(luminance, *taps, f.smooth, dx);
    filter.apply(luminance, f.smooth, *taps, dy);
    for_rows(height, [&, to = magnitude](int y) {
      for (size_t i = size_t(y) * width, end = i + width; i < end; ++i)
        (*to)[i] = std::sqrt(dx[i] * dx[i] + dy[i] * dy[i]);
    });
  }
  for_rows(height, [&](int y) {
    for (size_t i = size_t(y) * width, end = i + width; i < end; ++i)
      out.lab[i] = lab_of_opponent({channels[0][i], channels[1][i], channels[2][i]});
  });
  return out;
}

// Section 4.1.3: nearly all of the range goes to differences below kCompressAt of the largest.
float compressed(float distance, float largest) {
  const float x = std::pow(distance, static_cast<float>(kColourExponent));
  const float limit = static_cast<float>(kCompressAt) * largest, to = static_cast<float>(kCompressTo);
  return x < limit ? to / limit * x : to + (x - limit) / (largest - limit) * (1 - to);
}

}  // namespace

struct Flip::Impl {
  int width, height;
  double pixels_per_degree;
  Perceived reference;
};

Flip::Flip(const View& reference, double pixels_per_degree) {
  CHECK(reference.width > 0 && reference.height > 0);
  CHECK(reference.colour.size() == size_t(reference.width) * reference.height);
  CHECK(pixels_per_degree >= 1 && pixels_per_degree <= 1000);
  impl_.reset(new Impl{reference.width, reference.height, pixels_per_degree, perceive(reference, pixels_per_degree)});
}
Flip::~Flip() = default;
Flip::Flip(Flip&&) noexcept = default;

std::vector<float> Flip::error_map(const View& test) const {
  CHECK(test.width == impl_->width && test.height == impl_->height);
  CHECK(test.colour.size() == size_t(test.width) * test.height);
  const Perceived other = perceive(test, impl_->pixels_per_degree);
  const Perceived& own = impl_->reference;
  const float largest = std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), static_cast<float>(kColourExponent));
  std::vector<float> map(test.colour.size());
  for_rows(test.height, [&](int y) {
    for (size_t i = size_t(y) * test.width, end = i + test.width; i < end; ++i) {
      const float colour = std::clamp(compressed(hyab(own.lab[i], other.lab[i]), largest), 0.0f, 1.0f);
      const float feature =
          std::max(std::abs(own.edges[i] - other.edges[i]), std::abs(own.points[i] - other.points[i]));
      const float f = std::clamp(std::pow(feature / std::numbers::sqrt2_v<float>, static_cast<float>(kFeatureExponent)),
                                 0.0f, 1.0f);
      map[i] = colour > 0 ? std::pow(colour, 1 - f) : 0.0f;
    }
  });
  return map;
}

uint32_t magma(float error) {
  static constexpr uint8_t kAnchors[9][3] = {{0, 0, 4},      {28, 16, 68},    {79, 18, 123},
                                             {129, 37, 129}, {181, 54, 122},  {229, 80, 100},
                                             {251, 135, 97}, {254, 194, 135}, {252, 253, 191}};
  const float at = (error > 0 ? std::min(error, 1.0f) : 0.0f) * 8;  // NaN becomes 0
  const int i = std::min(static_cast<int>(at), 7);
  uint32_t out = 0;
  for (int c = 0; c < 3; ++c) {
    const float v =
        kAnchors[i][c] + (at - static_cast<float>(i)) * static_cast<float>(kAnchors[i + 1][c] - kAnchors[i][c]);
    out = out << 8 | static_cast<uint32_t>(v + 0.5f);
  }
  return out;
}

View picture_of_errors(const std::vector<float>& map, int width, int height) {
  CHECK(map.size() == size_t(width) * height);
  View out{width, height, std::vector<uint32_t>(map.size()), {}};
  std::transform(map.begin(), map.end(), out.colour.begin(), magma);
  return out;
}

}  // namespace telesplat::image
