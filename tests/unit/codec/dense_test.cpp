// Dense tiles: some image uses each way to code a plane, and comes back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>

#include "common/codec/dense/normals.h"
#include "common/codec/depth_codec.h"
#include "common/image/normal.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using namespace detail;

using image::DepthImage;

StreamInfo expect_round_trip(const DepthImage& image) {
  const auto bytes = encode(image);
  const auto back = decode(bytes);
  EXPECT_TRUE(back.ok());
  if (back.ok()) {
    EXPECT_TRUE(*back == image) << image.width << " x " << image.height;
  }
  return inspect(bytes).value();
}

double bits_per_pixel(size_t bytes, const DepthImage& image) {
  return 8.0 * static_cast<double>(bytes) / static_cast<double>(image.pixels());
}

TEST(Dense, SmallTrianglesAreCodedByTheirPlanes) {
  const DepthImage image = test::facets(256, 200, 3);
  const StreamInfo info = expect_round_trip(image);
  EXPECT_LT(bits_per_pixel(info.depth_bytes, image), 11.5) << "their corners alone take 15 bits of noise";
  expect_round_trip(test::masked(image, test::random_mask(256, 200, 0.7, 2)));
}

// Rows of planes keep old values where no pixel is covered.
TEST(Dense, WhatWasCodedBeforeChangesNothing) {
  const DepthImage holes = test::masked(test::render({.width = 256, .height = 200}), test::band_mask(256, 200, 40)),
                   facets = test::masked(test::facets(256, 200, 3, 130), test::random_mask(256, 200, 0.6, 5)),
                   other = test::random_pixels(256, 256, 0.9, 7);
  for (const ErrorBounds& bounds : {ErrorBounds{}, ErrorBounds{.depth = 1u << 18, .normal = 1, .colour = 1}})
    for (const DepthImage* image : {&holes, &facets}) {
      std::vector<uint8_t> fresh;
      std::thread([&] { fresh = encode(*image, bounds); }).join();  // a thread's coders have coded nothing yet
      EXPECT_TRUE(decode(encode(other, bounds)).ok());
      EXPECT_EQ(encode(*image, bounds), fresh);
      DepthImage known;
      EXPECT_EQ(encode(*image, bounds, &known), fresh);
      EXPECT_TRUE(decode(encode(other)).ok());
      EXPECT_EQ(decode(fresh).value(), known);
      EXPECT_EQ(decode_refinement(encode_refinement(*image, known), known).value(), *image);
    }
}

// Every mask that is coded as a dense tile has the values that contexts are chosen by.
TEST(Dense, ThinMasksHaveContextsToo) {
  constexpr int kSide = 256;
  DepthImage image(kSide, kSide);
  std::mt19937 random(9);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const auto i = static_cast<size_t>(y * kSide + x);
      const uint32_t rough = static_cast<uint32_t>((x / 64 + y / 64) % 5);  // from smooth to noise
      image.depth[i] = 4000000 + random() % (1u << 3 * rough), image.colour[i] = 0x8090A0;
      image.normal[i] = static_cast<uint16_t>((100 + random() % (1u << rough)) | (110 + random() % (1u << rough)) << 8);
    }
  const auto full = static_cast<double>(encode(image).size());
  const auto keep = [&](auto covered) {
    DepthImage part = image;
    for (size_t i = 0; i < part.pixels(); ++i)
      if (!covered(i % kSide, i / kSide)) part.depth[i] = part.colour[i] = part.normal[i] = 0;
    const auto bytes = encode(part);
    EXPECT_EQ(inspect(bytes).value().sparse_bytes, 0u);
    EXPECT_EQ(decode(bytes).value(), part);
    return static_cast<double>(bytes.size()) / full;
  };
  EXPECT_LT(keep([](size_t x, size_t y) { return (x + y) % 2 == 0; }), 0.61);
  EXPECT_LT(keep([](size_t, size_t y) { return y % 2 == 0; }), 0.6);
  EXPECT_LT(keep([](size_t, size_t y) { return y % 2 == 1; }), 0.6);
  EXPECT_LT(keep([](size_t x, size_t) { return x % 2 == 0; }), 0.6);
  EXPECT_LT(keep([](size_t, size_t y) { return y % 11 != 1; }), 1);
}

// A rough ball in front of a camera that looks along -z, its ray axes, and those of a camera with another direction.
struct Ball {
  static constexpr int kWidth = 256, kHeight = 200;
  Ball() : image(kWidth, kHeight) {
    const glm::dvec3 centre(0.3, -0.2, -3);
    std::mt19937 random(1);
    const auto noise = [&] {  // mostly small
      double sum = -2;
      for (int i = 0; i < 4; ++i) sum += static_cast<double>(random() % 1000) / 1000;
      return 0.03 * sum;
    };
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto along = [&](size_t i) { return axes[i][0] * x + axes[i][1] * y + axes[i][2]; };
        const glm::dvec3 ray(along(0), along(1), along(2));
        const double a = glm::dot(ray, ray), b = glm::dot(ray, centre),
                     c = glm::dot(centre, centre) - kRadius * kRadius;
        const double depth = (b - std::sqrt(b * b - a * c)) / a;
        const auto i = static_cast<size_t>(y * kWidth + x);
        image.depth[i] = image::encode_depth(depth, 0.5), image.colour[i] = 0x8090A0;
        image.normal[i] = image::encode_normal16(
            glm::vec3(glm::normalize((depth * ray - centre) / kRadius + glm::dvec3(noise(), noise(), noise()))));
      }
  }
  static constexpr double kRadius = 2.2;
  const RoomAxes axes = {{{0.004, 0, -0.5}, {0, -0.004, 0.4}, {0, 0, -1}}};
  const RoomAxes other = {{{0.004, 0, -0.5}, {0, 0, -1}, {0, 0.004, -0.4}}};
  DepthImage image;
};

TEST(Dense, TheCameraIsTakenForNormalsThatFollowIt) {
  const Ball ball;
  const auto without = encode(ball.image), known = encode(ball.image, {}, nullptr, ball.axes);
  EXPECT_EQ(decode(known).value(), ball.image);
  EXPECT_NE(known, without);
  EXPECT_EQ(encode(ball.image, {}, nullptr, ball.other), without) << "normals that do not follow what is said";
}

// Small tiles have too few samples to show it.
TEST(Dense, RoughNormalsWithinBoundsAreNotExactHoweverSmallTheTile) {
  for (const int side : {16, 20, 31, 60}) {
    DepthImage image = test::random_pixels(side, side, 1, 3), bounded;
    std::fill(image.colour.begin(), image.colour.end(), 0x8090A0);
    for (uint16_t& n : image.normal) n = image::canonical_normal16(n);
    encode(image, {.normal = 1}, &bounded);
    EXPECT_NE(bounded.normal, image.normal) << side;
  }
  DepthImage smooth = test::plane(90, 80, 30, 20), bounded;
  for (size_t i = 0; i < smooth.pixels(); ++i)
    smooth.colour[i] = 0x8090A0, smooth.normal[i] = static_cast<uint16_t>((100 + i % 90 / 9) | (110 + i / 900) << 8);
  encode(smooth, {.normal = 1}, &bounded);
  EXPECT_EQ(bounded.normal, smooth.normal) << "they are all that is seen of a smooth surface of one colour";
}

// The axes of test::render()'s view.
RoomAxes axes_of_render(int width, int height) {
  const double pitch = -50 * std::numbers::pi / 180, c = std::cos(pitch), s = std::sin(pitch);
  const double f = width / 2.0 / std::tan(55 * std::numbers::pi / 360), right = (0.5 - width / 2.0) / f,
               up = (height / 2.0 - 0.5) / f;
  return {{{1 / f, 0, right}, {0, -c / f, c * up + s}, {0, -s / f, s * up - c}}};
}

TEST(Dense, NormalsFollowFromDepth) {
  const DepthImage image = test::render({.width = 256, .height = 200});
  const auto bytes = encode(image, {}, nullptr, axes_of_render(256, 200));
  EXPECT_EQ(decode(bytes).value(), image);
  EXPECT_LT(bits_per_pixel(inspect(bytes).value().normal_bytes, image), 4.2) << "5.9 without depth";
}

TEST(Dense, NormalsThatAreNotCanonicalComeBack) {
  DepthImage image = test::render({.width = 120, .height = 90});
  image.normal[5000] = 0xFFFF;
  expect_round_trip(image);
  image.normal[5000] = static_cast<uint16_t>(254 | 30 << 8);  // on the map's border: canonical is 254, 224
  expect_round_trip(image);
}

TEST(Dense, PalettesComeBack) {
  std::mt19937 random(4);
  for (const uint32_t count : {2u, 3u, 200u, 256u, 257u, 1023u, 1024u, 1025u}) {
    DepthImage image = test::plane(200, 150, 30, 20);
    for (uint32_t& c : image.colour) c = random() % count * 0x3051 & 0xFFFFFF;
    expect_round_trip(image);
    expect_round_trip(test::masked(image, test::random_mask(200, 150, 0.5, count)));
  }
}

TEST(Dense, RoughColoursGrowLittle) {
  std::mt19937 random(6);
  DepthImage image = test::plane(256, 200, 30, 20);
  for (uint32_t& c : image.colour) c = random() & 0xFFFFFF;
  EXPECT_LT(bits_per_pixel(expect_round_trip(image).colour_bytes, image), 24.5);
}

TEST(Dense, NarrowTilesComeBack) {
  for (const int width : {1, 2, 3, 15, 16, 17, 31, 32, 33}) {
    expect_round_trip(test::render({.width = width, .height = 300}));
    expect_round_trip(test::random_pixels(width, 200, 0.6, static_cast<uint32_t>(width)));
    expect_round_trip(test::random_pixels(200, width, 0.6, static_cast<uint32_t>(width)));
  }
}

// A thread uses the same buffers in both directions.
TEST(Dense, WhoDecodedANarrowTileEncodesAnyOther) {
  const auto narrow = encode(test::render({.width = 9, .height = 200}));
  const DepthImage image = test::render({.width = 40, .height = 33});
  const auto expected = encode(image);
  std::thread([&] {
    EXPECT_TRUE(decode(narrow).ok());
    EXPECT_EQ(encode(image), expected);
  }).join();
}

TEST(Dense, TurnedNormalsAreAPermutationOfCanonicalCodes) {
  for (int pole = 0; pole < detail::kPoles; ++pole) {
    std::vector<bool> seen(65536);
    for (uint32_t code = 0; code < 65536; ++code) {
      const auto c = static_cast<uint16_t>(code);
      if (image::canonical_normal16(c) != c) continue;
      const uint16_t turned = detail::turn_normal(c, pole);
      ASSERT_EQ(image::canonical_normal16(turned), turned);
      ASSERT_EQ(detail::turn_back(turned, pole), c);
      ASSERT_FALSE(seen[turned]);
      seen[turned] = true;
    }
  }
}

TEST(Dense, CanonicalNormalsMeanTheSame) {
  int others = 0;
  for (uint32_t code = 0; code < 65536; ++code) {
    const auto c = static_cast<uint16_t>(code), canonical = image::canonical_normal16(c);
    ASSERT_EQ(image::octahedral16(canonical), image::octahedral16(c)) << code;
    ASSERT_EQ(image::canonical_normal16(canonical), canonical) << code;
    others += canonical != c;
  }
  EXPECT_EQ(others, 511 + 504 + 3) << "coordinates of 255, the border's other halves, three of its corners";
  std::mt19937 random(1);
  for (int i = 0; i < 100000; ++i) {
    const auto part = [&] { return static_cast<float>(static_cast<int>(random() % 41) - 20); };
    const uint16_t code = image::encode_normal16({part(), part(), part()});
    ASSERT_EQ(image::canonical_normal16(code), code);
  }
}

}  // namespace
}  // namespace telesplat::codec
