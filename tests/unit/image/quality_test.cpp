// PSNR, SSIM and hole fraction against their formulae, computed here in the slow way.
#include "common/image/measures/quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace telesplat::image {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

View flat(int width, int height, uint32_t colour, float depth_m) {
  const size_t n = size_t(width) * height;
  return {width, height, std::vector<uint32_t>(n, colour), std::vector<float>(n, depth_m)};
}

// Smooth patterns with noise, and background in places.
View pattern(int width, int height, uint32_t seed, double noise) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  View v = flat(width, height, 0x141820, kNothing);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if ((x / 9 + y / 7) % 4 == 0) continue;
      uint32_t colour = 0;
      for (int c = 0; c < 3; ++c) {
        const double value = 128 + 90 * std::sin(0.2 * x + c) * std::cos(0.15 * y - c) + noise * gauss(random);
        colour = colour << 8 | static_cast<uint32_t>(std::clamp(value, 0.0, 255.0));
      }
      v.colour[size_t(y) * width + x] = colour;
      v.depth_m[size_t(y) * width + x] = 1;
    }
  return v;
}

// Wang et al. 2004, equation 13, at one pixel, in double precision, two-pass; windows cut at the image's edges.
double ssim_at(const View& a, const View& b, int px, int py) {
  const auto luma = [](uint32_t c) { return 0.299 * (c >> 16 & 255) + 0.587 * (c >> 8 & 255) + 0.114 * (c & 255); };
  const auto for_window = [&](const auto& visit) {
    for (int y = std::max(0, py - 5); y <= std::min(a.height - 1, py + 5); ++y)
      for (int x = std::max(0, px - 5); x <= std::min(a.width - 1, px + 5); ++x) {
        const size_t at = size_t(y) * a.width + x;
        visit(std::exp(-((x - px) * (x - px) + (y - py) * (y - py)) / (2 * 1.5 * 1.5)), luma(a.colour[at]),
              luma(b.colour[at]));
      }
  };
  double w = 0, ma = 0, mb = 0, va = 0, vb = 0, cov = 0;
  for_window([&](double g, double la, double lb) { w += g, ma += g * la, mb += g * lb; });
  ma /= w, mb /= w;
  for_window([&](double g, double la, double lb) {
    va += g * (la - ma) * (la - ma), vb += g * (lb - mb) * (lb - mb), cov += g * (la - ma) * (lb - mb);
  });
  const double c1 = 6.5025, c2 = 58.5225;
  return (2 * ma * mb + c1) * (2 * cov / w + c2) / ((ma * ma + mb * mb + c1) * (va / w + vb / w + c2));
}

TEST(Quality, IdenticalViewsAreThe99DecibelCase) {
  const View v = pattern(61, 43, 1, 5);
  const Quality q = compare(v, v);
  EXPECT_EQ(q.psnr_db, 99);
  EXPECT_NEAR(q.ssim, 1, 1e-6);
  EXPECT_EQ(q.hole_fraction, 0);
}

TEST(Quality, PsnrOfAKnownError) {
  // All channels are off by 10 on the object, by 200 on a background that neither view calls the object.
  View a = flat(20, 10, 0x404040, 1), b = flat(20, 10, 0x4a4a4a, 1);
  for (int i = 0; i < 100; ++i) a.depth_m[i] = b.depth_m[i] = kNothing, a.colour[i] = 0, b.colour[i] = 0xc8c8c8;
  EXPECT_NEAR(compare(a, b).psnr_db, 20 * std::log10(255.0 / 10), 1e-9);
  EXPECT_EQ(compare(a, b).object_pixels, 100u);
}

TEST(Quality, PixelsThatOnlyOneOfTheTwoShowsCount) {
  View a = flat(10, 10, 0, kNothing), b = a;
  a.depth_m[0] = 1, a.colour[0] = 0xffffff;  // object missing in b: error 255
  b.depth_m[1] = 1;                          // object only in b: no colour error
  const Quality q = compare(a, b);
  EXPECT_NEAR(q.psnr_db, 10 * std::log10(2.0), 1e-9);
  EXPECT_EQ(q.object_pixels, 1u);
  EXPECT_EQ(q.hole_fraction, 1);
}

TEST(Quality, SsimIsTheFormulasMeanOverTheUnion) {
  for (const auto& [width, height] : {std::pair{61, 43}, {7, 90}, {5, 3}, {1, 1}}) {
    const View a = pattern(width, height, 2, 0), b = pattern(width, height, 3, 25);
    double sum = 0, squared = 0;
    size_t pixels = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const size_t at = size_t(y) * width + x;
        if (std::isinf(a.depth_m[at]) && std::isinf(b.depth_m[at])) continue;
        ++pixels;
        sum += ssim_at(a, b, x, y);
        for (int shift : {0, 8, 16}) {
          const double e = double(a.colour[at] >> shift & 255) - double(b.colour[at] >> shift & 255);
          squared += e * e;
        }
      }
    const Quality q = compare(a, b);
    if (pixels == 0) {
      EXPECT_EQ(q.object_pixels, 0u);
      continue;
    }
    EXPECT_NEAR(q.ssim, sum / pixels, 1e-5) << width << "x" << height;
    EXPECT_NEAR(q.psnr_db, 10 * std::log10(255.0 * 255.0 * 3 * pixels / squared), 1e-9);
    if (pixels > 500) {
      EXPECT_LT(q.ssim, 0.95);
    }
  }
}

TEST(Quality, HolesAreBackgroundOrFartherByMoreThanOnePercent) {
  const View a = flat(10, 10, 0x808080, 2);
  View b = a;
  b.depth_m[0] = kNothing;                                 // hole
  b.depth_m[1] = 2.03f;                                    // hole: 1.5 % farther
  b.depth_m[2] = 2.01f;                                    // 0.5 % farther: not
  b.depth_m[3] = 1.0f;                                     // something in front: not
  b.depth_m[4] = std::numeric_limits<float>::quiet_NaN();  // no depth: hole
  EXPECT_DOUBLE_EQ(compare(a, b).hole_fraction, 0.03);
}

TEST(Quality, CoveredBackgroundAndNearerPixelsAreShares) {
  View a = flat(10, 10, 0x808080, 2);
  a.depth_m[0] = a.depth_m[1] = a.depth_m[2] = kNothing;
  View b = a;
  b.depth_m[0] = b.depth_m[1] = 3;  // background that is covered
  b.depth_m[5] = 1.97f;             // 1.5 % nearer
  b.depth_m[6] = 1.99f;             // 0.5 % nearer: not
  b.depth_m[7] = kNothing;          // a hole: not
  EXPECT_DOUBLE_EQ(compare(a, b).covered_fraction, 0.02);
  EXPECT_DOUBLE_EQ(compare(a, b).nearer_fraction, 0.01);
}

TEST(Quality, AnyRayThatMeetsTheDataMakesAPixelNoBackground) {
  Reference a{4, flat(2, 1, 0x808080, kNothing), {1, 0}, {2, kNothing}};
  View b = flat(2, 1, 0x808080, 1.9f);
  EXPECT_DOUBLE_EQ(compare(a, b).covered_fraction, 0.5);
  EXPECT_DOUBLE_EQ(compare(a, b).nearer_fraction, 0.5);
}

TEST(Quality, NothingIsDefinedWithoutAnObject) {
  const View a = flat(10, 10, 0x808080, kNothing);
  const Quality q = compare(a, a);
  EXPECT_EQ(q.object_pixels, 0u);
}

}  // namespace
}  // namespace telesplat::image
