// Pictures of single points: place, size, and which of two wins.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/splat/flat/splat_table.h"
#include "tests/support/splat_scene.h"

namespace telesplat {
namespace {

using splat::Kernel;
using testing::Frame;
using testing::HandMadeItem;

constexpr int kWidth = 600, kHeight = 400;
constexpr uint32_t kBackground = 0xff010203;
const geometry::Box kLeaf{{-1.5f, -1.5f, -3.0f}, {1.5f, 1.5f, 0.0f}};

Frame render(std::vector<splat::DrawItem> items, Kernel kernel = Kernel::kSquare, splat::SplatStats* stats = nullptr) {
  const geometry::Camera camera = testing::front_camera(kWidth, kHeight);
  Frame frame(kWidth, kHeight);
  const auto s = splat::CpuSplatter(2).render(testing::draw_list(std::move(items)), camera, kernel,
                                              testing::unlit(camera), frame.target());
  if (stats) *stats = s;
  return frame;
}

// A point that projects to (x_pix, y_pix).
glm::dvec3 at_pixel(double x_pix, double y_pix, double depth_m = 1.0) {
  return testing::front_camera(kWidth, kHeight).unproject(x_pix, y_pix, depth_m);
}

std::set<std::pair<int, int>> covered(const Frame& frame) {
  std::set<std::pair<int, int>> out;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x)
      if (frame.at(x, y) != kBackground) out.insert({x, y});
  return out;
}

TEST(CpuSplatter, SquareCoversThePixelsNearestItsCentre) {
  for (int size = 1; size <= 8; ++size)
    for (const auto& [cx, cy] : {std::pair{300.3, 200.6}, {256.1, 255.9}, {511.7, 256.2}, {40.45, 383.55}}) {
      HandMadeItem item(kLeaf);
      item.add_at(at_pixel(cx, cy), 0xabcdef);
      const Frame frame = render({item.item(float(size))});
      const int x0 = int(std::floor(cx - 0.5 * size + 0.5)), y0 = int(std::floor(cy - 0.5 * size + 0.5));
      std::set<std::pair<int, int>> expected;
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) expected.insert({x0 + x, y0 + y});
      EXPECT_EQ(covered(frame), expected) << "size " << size << " at " << cx << ", " << cy;
      EXPECT_EQ(frame.at(x0, y0), 0xffabcdefu);
      EXPECT_NEAR(frame.depth_m[size_t(y0) * kWidth + x0], 1.0, 4e-4) << "the bias, up to 5e-3, must not show";
    }
}

TEST(CpuSplatter, SquaresOfFractionalSizeCoverThatAreaOnAverage) {
  for (const float size : {1.25f, 1.5f, 2.75f, 3.5f}) {
    double pixels = 0;
    for (int i = 0; i < 64; ++i) {
      const double cx = 300.0625 + i % 8 / 8.0, cy = 200.0625 + i / 8 / 8.0;  // amid the eighths of a pixel
      HandMadeItem item(kLeaf);
      item.add_at(at_pixel(cx, cy), 0xabcdef);
      const auto set = covered(render({item.item(size)}));
      pixels += double(set.size());
      EXPECT_TRUE(set.contains({int(cx), int(cy)}));
      for (const auto& [x, y] : set)
        EXPECT_LE(std::max(std::abs(x + 0.5 - cx), std::abs(y + 0.5 - cy)), 0.5 * size + 0.07) << size;
    }
    EXPECT_NEAR(pixels / 64, size * size, 0.07 * size * size) << size;
  }
}

TEST(CpuSplatter, SamplesAlignedWithPixelsStayExact) {
  // As a still camera of the sampling view's size sees them: splats larger than a pixel (scale 1.3) cover their own
  // pixels alone.
  const geometry::Camera camera = testing::front_camera(kWidth, kHeight);
  HandMadeItem item(kLeaf);
  for (int y = 90; y < 130; ++y)
    for (int x = 120; x < 160; ++x)
      item.add_at(camera.unproject(x + 0.5, y + 0.5, 1.0 + 0.003 * (x - 120)),
                  0x010000u + uint32_t(y) * 256 + uint32_t(x));
  const Frame frame = render({item.item(1.3f)});
  EXPECT_EQ(covered(frame).size(), 40u * 40u);
  for (int y = 90; y < 130; ++y)
    for (int x = 120; x < 160; ++x) ASSERT_EQ(frame.at(x, y), 0xff010000u + uint32_t(y) * 256 + uint32_t(x));
}

TEST(CpuSplatter, TilesAreFinishedAsTheWholeImageWouldBe) {
  const geometry::Camera camera = testing::front_camera(kWidth, kHeight);
  const image::Shading shading({}, camera);
  auto made = testing::random_items(17, 120, 900);
  std::vector<splat::DrawItem> items;
  for (size_t i = 0; i < made.size(); ++i) items.push_back(made[i].item(1.0f + 0.04f * float(i)));
  const splat::DrawList list = testing::draw_list(std::move(items));
  const int reach = splat::finish_reach({true, true, true});  // near the image's edges the plain loops see less
  for (const Kernel kernel : {Kernel::kSquare, Kernel::kDisc}) {
    splat::CpuSplatter splatter(2);
    // Switching stages on and off changes the tiles' layout.
    for (const int stages : {7, 1, 0, 2, 4, 3, 7}) {
      const splat::Finish finish{(stages & 1) != 0, (stages & 2) != 0, (stages & 4) != 0};
      const Frame expected = testing::splat_plainly(list, camera, kernel, shading, finish);
      Frame frame(kWidth, kHeight);
      splatter.render(list, camera, {kernel, finish}, shading, frame.target());
      size_t different = 0;
      for (int y = reach; y < kHeight - reach; ++y)
        for (int x = reach; x < kWidth - reach; ++x) {
          const size_t i = size_t(y) * kWidth + x;
          different += frame.colour[i] != expected.colour[i] || frame.depth_m[i] != expected.depth_m[i];
        }
      EXPECT_EQ(different, 0u) << splat::kernel_name(kernel) << ", stages " << stages;
    }
  }
}

TEST(CpuSplatter, DiscCoversThePixelsWithinItsRadius) {
  for (int size = 2; size <= 12; ++size) {
    HandMadeItem item(kLeaf);
    const double cx = 300.32, cy = 200.57;  // near the middle of an eighth of a pixel
    item.add_at(at_pixel(cx, cy), 0xabcdef);
    const auto pixels = covered(render({item.item(float(size))}, Kernel::kDisc));
    ASSERT_FALSE(pixels.empty());
    for (int y = 180; y < 220; ++y)
      for (int x = 280; x < 320; ++x) {
        const double r = std::hypot(x + 0.5 - cx, y + 0.5 - cy);
        if (r < 0.5 * size - 0.2) {
          EXPECT_TRUE(pixels.contains({x, y})) << size << ": " << x << ", " << y;
        }
        if (r > 0.5 * size + 0.2) {
          EXPECT_FALSE(pixels.contains({x, y})) << size << ": " << x << ", " << y;
        }
      }
    EXPECT_NEAR(double(pixels.size()), 0.25 * 3.14159 * size * size, 0.15 * size * size + 1);
  }
}

TEST(CpuSplatter, SmallestDiscIsAPixel) {
  HandMadeItem item(kLeaf);
  item.add_at(at_pixel(100.02, 100.02), 0xffffff);
  EXPECT_EQ(covered(render({item.item(1.0f)}, Kernel::kDisc)), (std::set<std::pair<int, int>>{{100, 100}}));
}

TEST(CpuSplatter, NearestPointWins) {
  HandMadeItem far_item(kLeaf), near_item(kLeaf);
  far_item.add_at(at_pixel(50.5, 50.5, 2.0), 0x111111);
  near_item.add_at(at_pixel(50.5, 50.5, 1.0), 0x222222);
  for (const auto& items : {std::vector{far_item.item(3), near_item.item(3)}, {near_item.item(3), far_item.item(3)}}) {
    const Frame frame = render(items);
    EXPECT_EQ(frame.at(50, 50), 0xff222222u);
    EXPECT_NEAR(frame.depth_m[50 * kWidth + 50], 1.0, 4e-4);
  }
}

TEST(CpuSplatter, OverlapOfASlantedSurfaceGoesToTheNearestCentre) {
  // Two samples a pixel apart on a receding surface: the pixel at the farther centre, which the nearer splat covers
  // too, shows the farther sample. A focal length of 300 pixels resolves 18 degrees at size 3, one of 1280 pixels 54
  // degrees.
  const double slope = std::tan(15 * 3.14159265 / 180) / testing::front_camera(kWidth, kHeight).focal_x();
  HandMadeItem a(kLeaf), b(kLeaf);
  a.add_at(at_pixel(100.5, 100.5, 1.0), 0x0000aa);
  b.add_at(at_pixel(101.5, 100.5, 1.0 + slope), 0x0000bb);
  const Frame frame = render({a.item(3), b.item(3)});
  EXPECT_EQ(frame.at(100, 100), 0xff0000aau);
  EXPECT_EQ(frame.at(101, 100), 0xff0000bbu);
}

TEST(CpuSplatter, HalfResolutionSamplesFillTheirBlocks) {
  // Samples at the pixel centres of a half-size frame, seen at the same pose: each fills its 2 x 2 block.
  const geometry::Camera half = testing::front_camera(kWidth / 2, kHeight / 2);
  HandMadeItem item(kLeaf);
  for (int y = 90; y < 110; ++y)
    for (int x = 120; x < 140; ++x)
      item.add_at(half.unproject(x + 0.5, y + 0.5, 1.0 + 0.003 * x), 0x010000u + uint32_t(y) * 256 + uint32_t(x));
  for (Kernel kernel : {Kernel::kSquare, Kernel::kDisc}) {
    const Frame frame = render({item.item(2.0f)}, kernel);
    EXPECT_EQ(covered(frame).size(), 40u * 40u);
    for (int y = 180; y < 220; ++y)
      for (int x = 240; x < 280; ++x) ASSERT_EQ(frame.at(x, y), 0xff010000u + uint32_t(y / 2) * 256 + uint32_t(x / 2));
  }
}

TEST(CpuSplatter, NothingBehindTheCameraOrOffScreen) {
  HandMadeItem item({{-3, -3, -3}, {3, 3, 3}});
  item.add_at({0, 0, 1}, 0xffffff);      // behind
  item.add_at({0, 0, -0.05}, 0xffffff);  // nearer than the near plane
  item.add_at({0, 0, 0}, 0xffffff);      // at the eye
  item.add_at({2.5, 0, -1}, 0xffffff);   // right of the frustum
  item.add_at({0, -2.5, -1}, 0xffffff);
  splat::SplatStats stats;
  EXPECT_TRUE(covered(render({item.item(7)}, Kernel::kSquare, &stats)).empty());
  EXPECT_EQ(stats.points_drawn, 0u);
}

TEST(CpuSplatter, ImageEdgesCutSplats) {
  HandMadeItem item(kLeaf);
  item.add_at(at_pixel(0.5, 0.5), 0xffffff);
  item.add_at(at_pixel(kWidth - 0.5, kHeight - 0.5), 0xffffff);
  EXPECT_EQ(covered(render({item.item(5)})).size(), 18u);
}

TEST(CpuSplatter, AnEmptyListIsBackground) {
  const Frame frame = render({});
  EXPECT_TRUE(covered(frame).empty());
  for (float d : frame.depth_m) ASSERT_EQ(d, std::numeric_limits<float>::infinity());
  HandMadeItem none(kLeaf);
  EXPECT_TRUE(covered(render({none.item(3)})).empty());
}

TEST(CpuSplatter, DepthIsOptional) {
  HandMadeItem item(kLeaf);
  item.add_at(at_pixel(50.5, 50.5), 0x00ff00);
  const geometry::Camera camera = testing::front_camera(kWidth, kHeight);
  Frame frame(kWidth, kHeight);
  splat::CpuSplatter(1).render(testing::draw_list({item.item(1)}), camera, Kernel::kSquare, testing::unlit(camera),
                               {kWidth, kHeight, frame.colour.data(), nullptr});
  EXPECT_EQ(frame.at(50, 50), 0xff00ff00u);
  EXPECT_EQ(frame.depth_m[0], -1.0f) << "untouched";
}

TEST(CpuSplatter, EveryPointOnScreenIsCountedOnce) {
  auto made = testing::random_items(5, 40, 500);
  std::vector<splat::DrawItem> items;
  uint64_t on_screen = 0;
  const geometry::Camera camera = testing::front_camera(kWidth, kHeight);
  const auto t = camera.room_to_pixel();
  for (auto& m : made) {
    items.push_back(m.item(1.0f));
    const auto& cluster = items.back().cluster;
    const auto& level = items.back().level;
    for (uint32_t i = 0; i < level.count; ++i) {
      const glm::dvec3 q(level.x[i], level.y[i], level.z[i]);
      const glm::dvec4 p(
          glm::dvec3(cluster->leaf_room.lo) + (q + 0.5) / 65536.0 * glm::dvec3(cluster->leaf_room.size()), 1.0);
      const double w = glm::dot(t.w, p), x = glm::dot(t.x, p) / w, y = glm::dot(t.y, p) / w;
      on_screen += w >= camera.near_m && x >= 0 && x < kWidth && y >= 0 && y < kHeight;
    }
  }
  splat::SplatStats stats;
  render(items, Kernel::kSquare, &stats);
  EXPECT_NEAR(double(stats.points_drawn), double(on_screen), 3.0) << "points within rounding of an edge may differ";
  EXPECT_GT(on_screen, 1000u);
}

TEST(PixelKey, FieldsComeBack) {
  std::mt19937 rng(3);
  for (int i = 0; i < 1000; ++i) {
    const uint32_t code = rng() % (splat::kMaxDepthCode + 1), spacing = rng() % 4, ring = rng() % 8,
                   normal = rng() & 0xffff, albedo = rng() & 0xffffff;
    const uint64_t key = splat::encode_key(code, spacing, ring, normal, albedo);
    EXPECT_EQ(splat::key_depth_code(key), code);
    EXPECT_EQ(splat::key_spacing(key), spacing);
    EXPECT_EQ(splat::key_ring(key), ring);
    EXPECT_EQ(splat::key_normal(key), normal);
    EXPECT_EQ(splat::key_albedo(key), albedo);
    const uint32_t info = splat::key_info(key);
    EXPECT_EQ(splat::info_depth_code(info), code);
    EXPECT_EQ(splat::info_spacing(info), spacing);
    EXPECT_EQ(splat::info_ring(info), ring);
    EXPECT_LT(int64_t(key), splat::kEmptyKey);
    EXPECT_GT(int64_t(key + splat::kOutsideSplat), splat::kEmptyKey);
  }
  EXPECT_NE(splat::encode_key(splat::kMaxDepthCode, 3, 7, 0xffff, 0xffffff), uint64_t(splat::kEmptyKey));
}

TEST(PixelKey, NearerDepthsHaveLesserKeysAndComeBackWithinHalfAStep) {
  for (const float near_m : {0.05f, 0.1f, 0.33f}) {
    int64_t last = -1;
    for (float z = near_m; z < near_m * 40000; z *= 1.00007f) {
      const uint32_t code = splat::encode_depth_code(z, near_m);
      EXPECT_GT(int64_t{code}, last) << z;
      last = code;
      EXPECT_NEAR(splat::decode_depth_code(code, near_m), z, z / 32768 * 1.01f);
    }
    EXPECT_LE(splat::encode_depth_code(3e38f, near_m) + splat::kMaxBias, splat::kMaxDepthCode);
  }
}

TEST(PixelKey, TheMeanBiasComesOff) {
  const splat::RimBias rim{0, 20, 81, 60};
  for (uint32_t spacing = 0; spacing < 4; ++spacing)
    for (int q = 0; q < 100; ++q) {
      const auto bias = uint32_t(std::lround(q * 0.01 * rim[spacing]));
      const uint32_t info = splat::key_info(splat::encode_key(5000 + bias, spacing, splat::ring_of(q * 0.01), 0, 0));
      EXPECT_NEAR(double(splat::unbiased_depth_code(info, rim)), 5000.0, rim[spacing] / 16.0 + 1);
    }
}

TEST(SplatTable, BiasGrowsToTheLimitAndNoFurther) {
  for (int side = 2; side <= splat::kMaxSplatSide; ++side) {
    uint32_t last = 0;
    for (double r2 = 0; r2 <= 0.5 * side * side + 2; r2 += 0.125) {
      const uint32_t bias = splat::splat_bias(r2, side, 640);
      EXPECT_GE(bias, last);
      EXPECT_LE(bias, splat::kMaxBias);
      last = bias;
    }
    EXPECT_GT(last, 0u);
  }
}

TEST(SplatTable, SizesRoundAsStated) {
  EXPECT_EQ(splat::square_size(1.0f), 1.0f);
  EXPECT_EQ(splat::square_size(1.3f), 1.5f);
  EXPECT_EQ(splat::square_size(0.1f), 1.0f);
  EXPECT_EQ(splat::square_size(100.0f), float(splat::kMaxSplatSide));
  EXPECT_EQ(splat::square_side(1.0f), 1);
  EXPECT_EQ(splat::square_side(1.01f), 2);
  EXPECT_EQ(splat::square_side(2.0f), 2);
  EXPECT_EQ(splat::disc_diameter(2.1f), 2.25f);
  EXPECT_EQ(splat::disc_diameter(0.1f), 1.0f);
}

// Linear between the centres of the pixels drawn, also for odd sizes and parts of pictures.
TEST(CpuSplatter, HalvedFramesAreInterpolated) {
  for (const auto& [width, height] : {std::pair{600, 400}, {601, 399}}) {
    const geometry::Camera camera = testing::front_camera(width, height), small = geometry::half_size(camera);
    const image::Shading shading({}, camera);
    auto made = testing::random_items(5, 60, 900);
    std::vector<splat::DrawItem> items;
    for (auto& m : made) items.push_back(m.item(1.5f));
    const splat::DrawList list = testing::draw_list(std::move(items));
    splat::CpuSplatter splatter(2);
    Frame drawn(small.width, small.height);
    splatter.render(list, small, {Kernel::kDisc, {}}, shading, drawn.target());
    const size_t pitch = size_t(width) + 9;
    std::vector<uint32_t> colour(pitch * size_t(height), 7);
    std::vector<float> depth_m(colour.size(), 7);
    splatter.render(list, camera, {Kernel::kDisc, {}, true}, shading,
                    {width, height, colour.data(), depth_m.data(), pitch});
    int varied = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const size_t at = size_t(y) * pitch + size_t(x);
        ASSERT_EQ(depth_m[at], drawn.depth_m[size_t(y / 2) * size_t(small.width) + size_t(x / 2)]) << x << ", " << y;
        const double u = std::clamp((x + 0.5) / 2 - 0.5, 0.0, small.width - 1.0),
                     v = std::clamp((y + 0.5) / 2 - 0.5, 0.0, small.height - 1.0);
        const int i = std::min(int(u), small.width - 2), j = std::min(int(v), small.height - 2);
        for (const int shift : {0, 8, 16, 24}) {
          const auto channel = [&](int dx, int dy) { return drawn.at(i + dx, j + dy) >> shift & 255; };
          const double a = u - i, b = v - j;
          const double expected = (1 - b) * ((1 - a) * channel(0, 0) + a * channel(1, 0)) +
                                  b * ((1 - a) * channel(0, 1) + a * channel(1, 1));
          ASSERT_NEAR(colour[at] >> shift & 255, expected, 2) << x << ", " << y << ", bit " << shift;
          varied += channel(0, 0) != channel(1, 0);
        }
      }
    EXPECT_GT(varied, 10000);
    EXPECT_EQ(colour[size_t(width)], 7u) << "beside the picture";
  }
}

}  // namespace
}  // namespace telesplat
