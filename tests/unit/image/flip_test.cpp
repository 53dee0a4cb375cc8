// FLIP against a second implementation: written only by the paper's formulas, in double precision, with whole
// two-dimensional filters and one pixel at a time.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <numeric>
#include <random>

#include "common/image/measures/flip.h"

namespace telesplat::image {
namespace {

using glm::dvec3;

double mean(const std::vector<float>& map) { return std::accumulate(map.begin(), map.end(), 0.0) / double(map.size()); }

View filled(int width, int height, uint32_t colour) {
  return {width, height, std::vector<uint32_t>(size_t(width) * height, colour), {}};
}

View noise(const View& base, double amplitude, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, amplitude);
  View out = base;
  for (uint32_t& c : out.colour) {
    uint32_t changed = 0;
    for (const int shift : {16, 8, 0})
      changed |= uint32_t(std::clamp(std::round(double(c >> shift & 255) + normal(random)), 0.0, 255.0)) << shift;
    c = changed;
  }
  return out;
}

// Smooth colours with an edge.
View scene(int width, int height) {
  View v = filled(width, height, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto channel = [&](double f) { return uint32_t(127.5 + 100 * std::sin(f)); };
      uint32_t c = channel(0.21 * x + 0.1 * y) << 16 | channel(0.15 * y) << 8 | channel(0.1 * x - 0.3 * y);
      if (3 * x + 2 * y > 2 * width) c ^= 0x404040;
      v.colour[size_t(y) * width + x] = c;
    }
  return v;
}

namespace slow {

const glm::dmat3 kRgbToXyz = glm::transpose(glm::dmat3(
    10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794, 2613072.0 / 12288897, 8788810.0 / 12288897,
    887015.0 / 12288897, 1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382));
const dvec3 kWhite = kRgbToXyz * dvec3(1);

dvec3 linear(uint32_t code) {
  dvec3 out;
  for (int i = 0; i < 3; ++i) {
    const double c = (code >> (16 - 8 * i) & 255) / 255.0;
    out[i] = c > 0.04045 ? std::pow((c + 0.055) / 1.055, 2.4) : c / 12.92;
  }
  return out;
}
dvec3 ycxcz(const dvec3& rgb) {
  const dvec3 t = kRgbToXyz * rgb / kWhite;
  return {116 * t.y - 16, 500 * (t.x - t.y), 200 * (t.y - t.z)};
}
dvec3 rgb_of_ycxcz(const dvec3& c) {
  const double y = (c.x + 16) / 116;
  return glm::inverse(kRgbToXyz) * (dvec3(y + c.y / 500, y, y - c.z / 200) * kWhite);
}
dvec3 hunt(const dvec3& rgb) {
  const dvec3 t = kRgbToXyz * rgb / kWhite;
  dvec3 f;
  for (int i = 0; i < 3; ++i)
    f[i] = t[i] > std::pow(6.0 / 29, 3) ? std::pow(t[i], 1.0 / 3) : t[i] * 841.0 / 108 + 4.0 / 29;
  const double l = 116 * f.y - 16;
  return {l, 0.01 * l * 500 * (f.x - f.y), 0.01 * l * 200 * (f.y - f.z)};
}
double hyab(const dvec3& a, const dvec3& b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

// Sum over a window of radius r of value(x, y) * weight(dx, dy), with repeated borders.
double filtered(int x, int y, int w, int h, int r, auto&& value, auto&& weight) {
  double sum = 0;
  for (int dy = -r; dy <= r; ++dy)
    for (int dx = -r; dx <= r; ++dx)
      sum += weight(dx, dy) * value(std::clamp(x + dx, 0, w - 1), std::clamp(y + dy, 0, h - 1));
  return sum;
}

std::vector<double> flip(const View& reference, const View& test, double ppd) {
  const double pi = std::numbers::pi;
  const int w = reference.width, h = reference.height;
  const int r = int(std::ceil(3 * std::sqrt(0.04 / (2 * pi * pi)) * ppd));
  const auto csf = [&](int channel, int dx, int dy) {
    const double d2 = (dx * dx + dy * dy) / (ppd * ppd);
    const auto gauss = [&](double a, double b) { return a * std::sqrt(pi / b) * std::exp(-pi * pi * d2 / b); };
    return channel == 0 ? gauss(1, 0.0047) : channel == 1 ? gauss(1, 0.0053) : gauss(34.1, 0.04) + gauss(13.5, 0.025);
  };
  double csf_sum[3] = {};
  for (int c = 0; c < 3; ++c)
    for (int dy = -r; dy <= r; ++dy)
      for (int dx = -r; dx <= r; ++dx) csf_sum[c] += csf(c, dx, dy);

  const double sd = 0.5 * 0.082 * ppd;
  const int fr = int(std::ceil(3 * sd));
  const auto feature_weight = [&](bool point, int dx, int dy) {
    const double g = std::exp(-(dx * dx + dy * dy) / (2 * sd * sd));
    return point ? (dx * dx / (sd * sd) - 1) * g : -dx * g;
  };
  double positive[2] = {}, negative[2] = {};
  for (const bool point : {false, true})
    for (int dy = -fr; dy <= fr; ++dy)
      for (int dx = -fr; dx <= fr; ++dx) {
        const double v = feature_weight(point, dx, dy);
        (v > 0 ? positive : negative)[point] += std::abs(v);
      }
  const auto normalised = [&](bool point, int dx, int dy) {
    const double v = feature_weight(point, dx, dy);
    return v / (v > 0 ? positive : negative)[point];
  };

  const auto lab_at = [&](const View& v, int x, int y) {
    dvec3 c;
    for (int i = 0; i < 3; ++i)
      c[i] = filtered(
          x, y, w, h, r, [&](int u, int t) { return ycxcz(linear(v.colour[size_t(t) * w + u]))[i]; },
          [&](int dx, int dy) { return csf(i, dx, dy) / csf_sum[i]; });
    return hunt(glm::clamp(rgb_of_ycxcz(c), 0.0, 1.0));
  };
  const auto feature_at = [&](const View& v, bool point, int x, int y) {
    const auto luminance = [&](int u, int t) { return (ycxcz(linear(v.colour[size_t(t) * w + u])).x + 16) / 116; };
    return std::hypot(filtered(x, y, w, h, fr, luminance, [&](int dx, int dy) { return normalised(point, dx, dy); }),
                      filtered(x, y, w, h, fr, luminance, [&](int dx, int dy) { return normalised(point, dy, dx); }));
  };
  const double cmax = std::pow(hyab(hunt({0, 1, 0}), hunt({0, 0, 1})), 0.7);
  std::vector<double> out;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const double e = std::pow(hyab(lab_at(reference, x, y), lab_at(test, x, y)), 0.7);
      const double colour = e < 0.4 * cmax ? e * 0.95 / (0.4 * cmax) : 0.95 + (e - 0.4 * cmax) / (0.6 * cmax) * 0.05;
      double difference = 0;
      for (const bool point : {false, true})
        difference = std::max(difference, std::abs(feature_at(reference, point, x, y) - feature_at(test, point, x, y)));
      out.push_back(std::pow(colour, 1 - std::sqrt(difference / std::sqrt(2.0))));
    }
  return out;
}

}  // namespace slow

TEST(Flip, AgreesWithTheFormulasTakenOneByOne) {
  const View reference = scene(23, 17), test = noise(reference, 30, 1);
  View shifted = reference;
  for (size_t i = 1; i < shifted.colour.size(); ++i) shifted.colour[i] = reference.colour[i - 1];
  for (const double ppd : {12.0, kFlipPixelsPerDegree})
    for (const View& other : {test, shifted, filled(23, 17, 0xffffff), filled(23, 17, 0x0000ff)}) {
      const auto expected = slow::flip(reference, other, ppd);
      const auto map = Flip(reference, ppd).error_map(other);
      ASSERT_EQ(map.size(), expected.size());
      for (size_t i = 0; i < map.size(); ++i)
        ASSERT_NEAR(map[i], expected[i], 2e-3) << "pixel " << i << ", ppd " << ppd;
    }
}

TEST(Flip, IdenticalPicturesDoNotDiffer) {
  const View v = scene(64, 40);
  for (const float e : Flip(v).error_map(v)) ASSERT_EQ(e, 0.0f);
}

TEST(Flip, BlackAgainstWhite) {
  // L* differs by 100: 100^0.7 = 25.12; the largest difference, green against blue: 203.2^0.7 = 41.26; 0.4 of it
  // becomes 0.95, the rest 0.05.
  for (const float e : Flip(filled(30, 20, 0)).error_map(filled(30, 20, 0xffffff))) ASSERT_NEAR(e, 0.9674, 5e-4);
  for (const float e : Flip(filled(30, 20, 0x00ff00)).error_map(filled(30, 20, 0x0000ff))) ASSERT_NEAR(e, 1.0, 1e-4);
}

TEST(Flip, DoesNotMindWhichIsTheReference) {
  const View a = scene(70, 50), b = noise(a, 20, 3);
  EXPECT_EQ(Flip(a).error_map(b), Flip(b).error_map(a));
}

TEST(Flip, MoreNoiseIsWorse) {
  const View v = scene(80, 60);
  const Flip flip(v);
  double last = 0;
  for (const double amplitude : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0}) {
    const auto map = flip.error_map(noise(v, amplitude, 5));
    for (const float e : map) ASSERT_TRUE(e >= 0 && e <= 1) << e;
    EXPECT_GT(mean(map), 1.2 * last) << amplitude;
    last = mean(map);
  }
}

TEST(Flip, FarAwayEverythingLooksMoreAlike) {
  const View v = scene(80, 60), other = noise(v, 20, 5);
  EXPECT_LT(mean(Flip(v, 120).error_map(other)), 0.8 * mean(Flip(v, 20).error_map(other)));
}

TEST(Flip, SmallPictures) {
  EXPECT_EQ(Flip(filled(1, 1, 0x123456)).error_map(filled(1, 1, 0x123456)), std::vector<float>{0.0f});
  EXPECT_GT(Flip(filled(1, 5, 0)).error_map(filled(1, 5, 0x00ff00))[2], 0.9f);
}

TEST(Magma, GetsLighterAsErrorsGrow) {
  const auto luma = [](uint32_t c) { return 0.299 * (c >> 16 & 255) + 0.587 * (c >> 8 & 255) + 0.114 * (c & 255); };
  for (int i = 1; i <= 100; ++i) EXPECT_GE(luma(magma(i / 100.0f)), luma(magma((i - 1) / 100.0f)) - 0.3) << i;
  EXPECT_LT(luma(magma(0)), 5);
  EXPECT_GT(luma(magma(1)), 230);
  EXPECT_EQ(magma(-1), magma(0));
  EXPECT_EQ(magma(7), magma(1));
  EXPECT_EQ(magma(std::nanf("")), magma(0));
  const View v = picture_of_errors({0, 0.5f, 1, 0}, 2, 2);
  EXPECT_EQ(v.colour[1], magma(0.5f));
}

}  // namespace
}  // namespace telesplat::image
