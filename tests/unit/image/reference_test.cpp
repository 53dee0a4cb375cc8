// Several rays a pixel: their places, their means, and measures of pictures against them.
#include "common/image/measures/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/image/measures/quality.h"

namespace telesplat::image {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

geometry::Camera camera(int width, int height) {
  geometry::Camera c;
  c.left = -0.7, c.right = 0.9, c.bottom = -0.4, c.top = 0.5;
  c.width = width, c.height = height;
  return c;
}

// Colour of a ray through (u, v): stripes before a gradient; background right of a slanted edge.
uint32_t colour_at(double u, double v) {
  if (u > 0.5 + 0.1 * v) return 0x102030;
  const auto grey = uint32_t(std::lround(127 + 100 * std::sin(40 * u + 25 * v)));
  return grey << 16 | grey << 8 | uint32_t(std::lround(255 * (u + 0.7) / 1.6));
}
float depth_at(double u, double v) { return u > 0.5 + 0.1 * v ? kNothing : float(u + v > 0 ? 2 : 1); }

View draw_rays(const geometry::Camera& c) {
  View out{c.width, c.height, {}, {}};
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      const double u = c.left + (x + 0.5) / c.focal_x(), v = c.top - (y + 0.5) / c.focal_y();
      out.colour.push_back(colour_at(u, v));
      out.depth_m.push_back(depth_at(u, v));
    }
  return out;
}

TEST(Supersample, EveryPixelIsTheMeanOfItsRaysThroughEqualParts) {
  for (const int side : {2, 4, 7}) {
    const auto c = camera(601, 333);  // several pieces for a side of 7
    const auto made = supersample(c, side * side, [](const geometry::Camera& fine) { return draw_rays(fine); });
    ASSERT_TRUE(made);
    EXPECT_EQ(made->samples, side * side);
    size_t wrong_colour = 0, wrong_hits = 0, wrong_depth = 0;
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        double sum[3] = {};
        int hits = 0, near = 0;
        for (int j = 0; j < side; ++j)
          for (int i = 0; i < side; ++i) {
            const double u = c.left + (x + (i + 0.5) / side) / c.focal_x();
            const double v = c.top - (y + (j + 0.5) / side) / c.focal_y();
            for (int k = 0; k < 3; ++k) sum[k] += colour_at(u, v) >> (8 * k) & 255;
            hits += depth_at(u, v) < kNothing;
            near += depth_at(u, v) == 1;
          }
        const size_t at = size_t(y) * c.width + x;
        for (int k = 0; k < 3; ++k)
          wrong_colour += std::abs((made->view.colour[at] >> (8 * k) & 255) - sum[k] / (side * side)) > 0.51;
        wrong_hits += made->hits[at] != hits;
        const float depth = near == side * side ? 1.0f : hits == side * side ? 2.0f : kNothing;
        wrong_depth += made->view.depth_m[at] != depth;
      }
    // Rays that graze an edge to the last bit may fall on either side of it.
    EXPECT_LE(wrong_colour, 5u) << side;
    EXPECT_LE(wrong_hits, 5u) << side;
    EXPECT_LE(wrong_depth, 5u) << side;
  }
}

TEST(Supersample, PiecesOfLargePicturesStayWithinTheirLimit) {
  const auto c = camera(4100, 9);
  int pieces = 0;
  const auto made = supersample(c, 16, [&](const geometry::Camera& fine) {
    ++pieces;
    EXPECT_LE(fine.width, 2048);
    EXPECT_LE(fine.height, 2048);
    EXPECT_TRUE(geometry::validate(fine));
    return draw_rays(fine);
  });
  ASSERT_TRUE(made);
  EXPECT_EQ(pieces, 9);
  EXPECT_EQ(made->hits[0], 16);
  EXPECT_EQ(made->hits[4099], 0);
}

TEST(Supersample, OneRayAPixelIsThePictureItself) {
  const auto c = camera(40, 30);
  const auto made = supersample(c, 1, [](const geometry::Camera& fine) { return draw_rays(fine); });
  ASSERT_TRUE(made);
  EXPECT_EQ(made->view.colour, draw_rays(c).colour);
  EXPECT_EQ(made->view.depth_m, draw_rays(c).depth_m);
  EXPECT_TRUE(made->hits.empty());
}

TEST(Supersample, ErrorsOfDrawingAreHandedOn) {
  for (const int samples : {1, 4}) {
    const auto made =
        supersample(camera(20, 10), samples, [](const geometry::Camera&) { return Result<View>(Error{"no data"}); });
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().text, "no data");
  }
}

TEST(Supersample, NumbersOfRaysAreSquares) {
  for (const int samples : {1, 4, 9, 16, 64}) EXPECT_TRUE(validate_samples(samples)) << samples;
  for (const int samples : {-16, 0, 2, 8, 15, 81, 1 << 30}) {
    ASSERT_FALSE(validate_samples(samples)) << samples;
    EXPECT_NE(validate_samples(samples).error().text.find(std::to_string(samples)), std::string::npos);
  }
}

// A row of pixels with four rays each; bits choose the rays that hit at depth 1, and those at depth 2.
Reference four_rays(const std::vector<std::pair<int, int>>& near_and_far) {
  const int n = int(near_and_far.size());
  geometry::Camera c = camera(n, 1);
  return *supersample(c, 4, [&](const geometry::Camera& fine) {
    View out{fine.width, fine.height, std::vector<uint32_t>(size_t(fine.width) * 2, 0x808080),
             std::vector<float>(size_t(fine.width) * 2, kNothing)};
    for (int x = 0; x < n; ++x) {
      const auto [near, far] = near_and_far[size_t(x)];
      for (int k = 0; k < near + far; ++k)
        out.depth_m[size_t(k / 2) * out.width + 2 * x + k % 2] = k < near ? 1.0f : 2.0f;
    }
    return out;
  });
}

TEST(QualityAgainstSeveralRays, AHoleShowsWhatNoRaySees) {
  const Reference r = four_rays({{4, 0}, {2, 0}, {1, 0}, {2, 2}, {1, 3}, {0, 2}, {0, 0}});
  View shown = r.view;
  const auto holes = [&](float depth) {
    std::fill(shown.depth_m.begin(), shown.depth_m.end(), depth);
    std::vector<int> out;
    for (size_t i = 0; i < shown.depth_m.size(); ++i) out.push_back(is_hole(r.view, shown, i));
    const Quality q = compare(r, shown);
    EXPECT_EQ(q.object_pixels, 3u);
    EXPECT_EQ(q.hole_pixels, size_t(std::count(out.begin(), out.end(), 1)));
    EXPECT_DOUBLE_EQ(q.hole_fraction, double(q.hole_pixels) / 3);
    return out;
  };
  EXPECT_EQ(holes(kNothing), (std::vector<int>{1, 0, 0, 1, 1, 0, 0}));
  EXPECT_EQ(holes(2), (std::vector<int>{1, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(holes(1), (std::vector<int>{0, 0, 0, 0, 0, 0, 0}));
}

TEST(QualityAgainstSeveralRays, PixelsThatOneRayOfFourMeetsCount) {
  Reference r = four_rays({{1, 0}, {0, 0}, {4, 0}, {4, 0}});
  View shown = r.view;
  shown.colour[0] = 0x808080 - 0x101010;  // 16 steps off where a quarter of the pixel is data
  shown.colour[1] = 0;                    // background: does not count
  EXPECT_NEAR(compare(r, shown).psnr_db, 10 * std::log10(255.0 * 255.0 * 3 / 256), 1e-9);
  EXPECT_NEAR(mean_error({0.6f, 0.9f, 0, 0}, r, shown), 0.2, 1e-6);
  shown.depth_m[1] = 1;  // the display shows an object that the data do not have
  EXPECT_NEAR(mean_error({0.6f, 0.9f, 0, 0}, r, shown), 0.375, 1e-6);
}

TEST(QualityAgainstSeveralRays, OneRayAPixelGivesTheFiguresOfItsPicture) {
  const auto c = camera(90, 60);
  const View reference = draw_rays(c);
  View shown = draw_rays(camera(90, 60));
  std::mt19937 random(3);
  for (size_t i = 0; i < shown.colour.size(); i += 3) {
    shown.colour[i] = random() & 0xffffff;
    if (i % 2) shown.depth_m[i] = kNothing;
  }
  const Quality a = compare(reference, shown), b = compare(reference_of(reference), shown);
  EXPECT_EQ(a.psnr_db, b.psnr_db);
  EXPECT_EQ(a.ssim, b.ssim);
  EXPECT_EQ(a.hole_pixels, b.hole_pixels);
  EXPECT_GT(b.hole_pixels, 0u);
  EXPECT_EQ(a.object_pixels, b.object_pixels);
}

TEST(QualityAgainstSeveralRays, FlipIsTheMeanOfItsMapWherePixelsCount) {
  const View reference = draw_rays(camera(90, 60));
  View shown = reference;
  for (uint32_t& colour : shown.colour) colour ^= 0x202020;
  const Reference r = reference_of(reference);
  const auto map = Flip(reference).error_map(shown);
  double sum = 0, count = 0;
  for (size_t i = 0; i < map.size(); ++i)
    if (reference.depth_m[i] < kNothing) sum += map[i], ++count;
  EXPECT_NEAR(flip(r, shown), sum / count, 1e-6);
  EXPECT_EQ(flip(r, reference), 0);
  EXPECT_GT(flip(r, shown), 0.02);
}

}  // namespace
}  // namespace telesplat::image
