// Bounds of error hold in every pixel of many images; and refinements give the exact image back.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "common/codec/depth_codec.h"
#include "common/image/normal.h"
#include "tests/support/codec/codec_images.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using image::DepthImage;

std::vector<ErrorBounds> many_bounds() {
  return {{.depth = ErrorBounds::kLeastDepth},
          {.depth = ErrorBounds::kMostDepth},
          {.normal = 1},
          {.normal = 3},
          {.colour = 1},
          {.colour = 15},
          error_bounds(1 / 32.0, 2 / 1280.0, 1, 1),
          error_bounds(1 / 16.0, 2 / 1280.0, 2, 2),
          error_bounds(1, 2 / 320.0, 3, 7),
          {.depth = 12345678, .normal = 2, .colour = 4}};
}

double angle_deg(uint16_t a, uint16_t b) {
  const glm::dvec3 u(image::octahedral16(a)), v(image::octahedral16(b));
  return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)) * 180 / std::numbers::pi;
}

// Compares depths as codes and in metres, normals in degrees, colours channel by channel, and the covered pixels.
void expect_within(const ErrorBounds& bounds, const DepthImage& a, const DepthImage& b) {
  constexpr double kNear = 0.02;
  ASSERT_EQ(a.width, b.width);
  ASSERT_EQ(a.height, b.height);
  const double share = bounds.depth / 4294967296.0, most_deg = normal_error_degrees(bounds.normal);
  for (size_t i = 0; i < a.pixels(); ++i) {
    ASSERT_EQ(a.depth[i] == 0, b.depth[i] == 0) << i;
    if (a.depth[i] == 0) continue;
    const int64_t code = a.depth[i], decoded = b.depth[i];
    ASSERT_LE(std::abs(code - decoded) << 32, int64_t{bounds.depth} * decoded) << i << ": " << code << ", " << decoded;
    const double z = image::decode_depth(a.depth[i], kNear), near_z = image::decode_depth(b.depth[i], kNear);
    ASSERT_LE(std::abs(z - near_z), share * z * (1 + 1e-9)) << i;
    if (bounds.normal == 0)
      ASSERT_EQ(a.normal[i], b.normal[i]) << i;
    else
      ASSERT_LE(angle_deg(a.normal[i], b.normal[i]), most_deg + 1e-9) << i;
    for (int shift = 0; shift < 24; shift += 8)
      ASSERT_LE(std::abs(int(a.colour[i] >> shift & 255) - int(b.colour[i] >> shift & 255)), bounds.colour) << i;
  }
}

TEST(CodecBounds, HoldInEveryPixelAndRefinementsAreExact) {
  for (uint32_t seed = 1; seed <= 4; ++seed)
    for (const DepthImage& image : test::codec_images(seed))
      for (const ErrorBounds& bounds : many_bounds()) {
        SCOPED_TRACE(::testing::Message()
                     << "seed " << seed << ", " << image.width << " x " << image.height << ", depth " << bounds.depth
                     << ", normal " << bounds.normal << ", colour " << bounds.colour);
        DepthImage told;
        const auto bytes = encode(image, bounds, &told);
        EXPECT_EQ(encode(image, bounds), bytes) << "not deterministic";
        const auto bounded = decode(bytes, image.width, image.height);
        ASSERT_TRUE(bounded.ok()) << bounded.error().text;
        ASSERT_TRUE(told == *bounded) << "the encoder says that something else is decoded";
        ASSERT_TRUE(test::is_canonical(*bounded));
        expect_within(bounds, image, *bounded);
        if (HasFatalFailure()) return;
        const auto info = inspect(bytes);
        ASSERT_TRUE(info.ok()) << info.error().text;
        EXPECT_EQ(info->bounds, bounds);
        const auto refinement = encode_refinement(image, *bounded);
        EXPECT_EQ(encode_refinement(image, *bounded), refinement) << "not deterministic";
        const auto exact = decode_refinement(refinement, *bounded);
        ASSERT_TRUE(exact.ok()) << exact.error().text;
        ASSERT_TRUE(*exact == image);
      }
}

// Damages a stream: cuts it at every length, and flips bits. Checks both streams and refinements.
template <class Decode>
void expect_damage_is_found(const std::vector<uint8_t>& bytes, std::mt19937& random, Decode decoded, size_t& refused) {
  for (size_t length = 0; length < bytes.size(); ++length) {
    const std::vector<uint8_t> part(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(length));
    ASSERT_FALSE(decoded(part).ok()) << length << " of " << bytes.size();
  }
  for (int trial = 0; trial < 100; ++trial) {
    auto bad = bytes;
    for (uint32_t flips = 1 + random() % 3; flips > 0; --flips)
      bad[random() % bad.size()] ^= static_cast<uint8_t>(1u << random() % 8);
    const auto image = decoded(bad);
    refused += !image.ok();
    if (image.ok()) {
      ASSERT_TRUE(test::is_canonical(*image));
    }
  }
}

TEST(CodecBounds, DamageIsAnErrorOrACanonicalImage) {
  std::mt19937 random(11);
  size_t refused = 0;
  for (const DepthImage& image : test::codec_images(3)) {
    const auto bytes = encode(image, error_bounds(1 / 32.0, 2 / 1280.0, 1, 1));
    expect_damage_is_found(
        bytes, random, [](const auto& b) { return decode(b); }, refused);
    const DepthImage bounded = decode(bytes).value();
    const auto refine = [&](const auto& b) {
      auto exact = decode_refinement(b, bounded);
      for (size_t i = 0; exact.ok() && i < bounded.pixels(); ++i)
        EXPECT_EQ(exact->depth[i] == 0, bounded.depth[i] == 0) << "a refinement changes no mask";
      return exact;
    };
    expect_damage_is_found(encode_refinement(image, bounded), random, refine, refused);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(refused, 500u);
}

TEST(CodecBounds, SeveralTilesAndNarrowOnes) {
  const ErrorBounds bounds = error_bounds(1 / 32.0, 2 / 1280.0, 1, 1);
  for (const double density : {0.02, 0.15, 0.7, 1.0})
    for (const auto& [width, height] :
         {std::pair{700, 300}, {513, 257}, {20, 3000}, {3000, 20}, {9000, 1}, {1, 9000}}) {
      DepthImage image = test::plane(width, height, 40, 90);
      test::keep_random(image, density, 3);
      DepthImage bounded;
      encode(image, bounds, &bounded);
      expect_within(bounds, image, bounded);
      const auto exact = decode_refinement(encode_refinement(image, bounded), bounded);
      ASSERT_TRUE(exact.ok()) << exact.error().text;
      ASSERT_TRUE(*exact == image) << density << ", " << width << " x " << height;
    }
}

TEST(CodecBounds, NoErrorIsTheLosslessStream) {
  const DepthImage image = test::render({.width = 100, .height = 80});
  EXPECT_EQ(encode(image, {}), encode(image));
  EXPECT_EQ(encode(image, {.depth = ErrorBounds::kLeastDepth - 1}), encode(image));
  EXPECT_TRUE(inspect(encode(image)).value().bounds.exact());
}

}  // namespace
}  // namespace telesplat::codec
