// Bounds of error: their valid values, the lattices that keep them, and streams with false bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/codec/dense/normals.h"
#include "common/codec/depth_codec.h"
#include "common/codec/lattice.h"
#include "common/image/normal.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using detail::ColourLattice;
using detail::DepthLattice;
using detail::NormalLattice;
using image::DepthImage;

TEST(ErrorBounds, APixelsFootprintIsAShareOfItsDepth) {
  EXPECT_EQ(error_bounds(0, 2 / 1280.0, 0, 0), ErrorBounds{});
  EXPECT_TRUE(error_bounds(0, 2 / 1280.0, 0, 0).exact());
  const ErrorBounds b = error_bounds(1 / 32.0, 2 / 1280.0, 1, 2);
  EXPECT_EQ(b.depth, static_cast<uint32_t>(4294967296.0 / 32 * 2 / 1280));
  EXPECT_EQ(b.normal, 1);
  EXPECT_EQ(b.colour, 2);
  EXPECT_FALSE(b.exact());
}

TEST(ErrorBounds, AreCutToWhatMakesSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), far = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error_bounds(1e-9, 0.001, 0, 0).depth, 0u);
  EXPECT_EQ(error_bounds(-1, 0.001, -5, -1), ErrorBounds{});
  EXPECT_EQ(error_bounds(nan, 0.001, 0, 0).depth, 0u);
  EXPECT_EQ(error_bounds(far, 0.001, 100, 1000), (ErrorBounds{ErrorBounds::kMostDepth, 3, 15}));
  EXPECT_TRUE((ErrorBounds{.depth = ErrorBounds::kLeastDepth - 1}).exact());
  EXPECT_FALSE((ErrorBounds{.depth = ErrorBounds::kLeastDepth}).exact());
}

// Every code lies in one interval, whose middle is within the bound; and no interval could be longer.
TEST(ErrorBounds, DepthLatticesReachEveryCode) {
  for (const uint32_t depth : {ErrorBounds::kLeastDepth, uint32_t{100003}, uint32_t{209715}, uint32_t{1} << 22,
                               uint32_t{123456789}, ErrorBounds::kMostDepth}) {
    const DepthLattice lattice(depth);
    uint32_t index = 0;
    for (uint32_t code = 0; code <= image::kMaxDepthCode; ++code) {
      const uint32_t i = lattice.index(code), m = lattice.code(i);
      ASSERT_TRUE(i == index || i == index + 1) << depth << ": " << code;
      if (i != index && m < image::kMaxDepthCode) {
        ASSERT_GT(m + 1 - lattice.reach(m + 1), code) << depth << ": a later code reaches the first of the interval";
      }
      ASSERT_LE(std::max(m, code) - std::min(m, code), uint64_t{m} * depth >> 32) << depth << ": " << code;
      index = i;
    }
    EXPECT_EQ(index, lattice.last());
    EXPECT_EQ(lattice.code(0xFFFFFFFF), lattice.code(lattice.last()));
    EXPECT_LT(lattice.last(), 1u << 20) << "of memory";
  }
}

TEST(ErrorBounds, OtherLatticesReachEveryValue) {
  for (int reach = 0; reach <= ErrorBounds::kMostNormal; ++reach) {
    const NormalLattice lattice(reach);
    for (int v = 0; v < 255; ++v) {
      ASSERT_LE(std::abs(lattice.nearest(v) - v), reach);
      ASSERT_EQ(lattice.index(lattice.nearest(v)), lattice.index(v));
      ASSERT_TRUE(lattice.index(v) >= 0 && lattice.index(v) <= lattice.most());
      if (reach > 0) {
        ASSERT_TRUE(lattice.nearest(v) >= 1 && lattice.nearest(v) <= 253) << "on the rim two codes mean one direction";
      }
      ASSERT_EQ(lattice.index64(64 * lattice.nearest(v)), 64 * lattice.index(v));
    }
    for (int v = 0; v <= 254 * 64; ++v) {
      const int exact = v - 64 * 127 + 32 * lattice.most() * lattice.step() + lattice.step() / 2;
      ASSERT_EQ(lattice.index64(v), std::max(exact, 0) / lattice.step()) << reach << ", " << v;
    }
  }
  for (int reach = 0; reach <= ErrorBounds::kMostColour; ++reach)
    for (int v = 0; v < 256; ++v) {
      const ColourLattice lattice(reach);
      ASSERT_LE(std::abs(lattice.value(lattice.index(v)) - v), reach);
      ASSERT_EQ(lattice.value(0), 0) << "black stays black";
    }
}

double angle_deg(uint16_t a, uint16_t b) {
  const glm::dvec3 u(image::octahedral16(a)), v(image::octahedral16(b));
  return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)) * 180 / std::numbers::pi;
}

TEST(ErrorBounds, DegreesAreThoseOfTheWorstNormal) {
  EXPECT_EQ(normal_error_degrees(0), 0);
  for (int reach = 1; reach <= ErrorBounds::kMostNormal; ++reach) {
    const NormalLattice lattice(reach);
    for (int pole = 0; pole < detail::kPoles; ++pole) {
      double most = 0;
      for (uint32_t code = 0; code < 65536; ++code) {
        const auto normal = static_cast<uint16_t>(code);
        const uint16_t turned = detail::turn_normal(image::canonical_normal16(normal), pole);
        const auto coarse = static_cast<uint16_t>(lattice.nearest(turned & 255) | lattice.nearest(turned >> 8) << 8);
        most = std::max(most, angle_deg(normal, detail::turn_back(coarse, pole)));
      }
      EXPECT_NEAR(most, normal_error_degrees(reach), 1e-9) << reach << ", pole " << pole;
    }
  }
  EXPECT_NEAR(normal_error_degrees(1), 1.914, 0.001);
  EXPECT_NEAR(normal_error_degrees(2), 3.825, 0.001);
  EXPECT_NEAR(normal_error_degrees(3), 5.733, 0.001);
}

std::string refusal(const std::vector<uint8_t>& bytes) {
  const auto image = decode(bytes);
  return image.ok() ? "" : image.error().text;
}

TEST(ErrorBounds, StreamsWithBoundsThatNobodyWrites) {
  // 1 x 1 pixels, none covered. varint depth, u8 normal, u8 colour.
  EXPECT_EQ(refusal({0xD7, 12, 1, 1, 1, 0, 1, 0, 0}), "");
  EXPECT_EQ(refusal({0xD7, 12, 1, 1, 1, 0x80, 0x80, 1, 0, 0, 0}), "") << "2^14";
  for (const auto& bounds : {std::vector<uint8_t>{0, 0, 0},
                             {1, 0, 0},
                             {0xFF, 0x7F, 1, 1},
                             {0x81, 0x80, 0x80, 0x80, 1, 0, 0},
                             {0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0, 0},
                             {0, 4, 0},
                             {0, 0, 16},
                             {0, 255, 255}}) {
    std::vector<uint8_t> bytes{0xD7, 12, 1, 1, 1};
    bytes.insert(bytes.end(), bounds.begin(), bounds.end());
    bytes.push_back(0);
    EXPECT_NE(refusal(bytes).find("bounds of error that nobody writes"), std::string::npos) << int(bounds[0]);
  }
  EXPECT_NE(refusal({0xD7, 12, 1, 1, 1, 0, 1}), "");
}

TEST(ErrorBounds, IndicesOfDepthBeyondTheLast) {
  DepthImage image(1, 1);
  image.depth[0] = image::kMaxDepthCode;
  const ErrorBounds bounds{.depth = ErrorBounds::kMostDepth};
  auto bytes = encode(image, bounds);
  ASSERT_EQ(refusal(bytes), "");
  const size_t base = 5 + 5 + 2 + 1;  // header, varint of 2^28, two bytes, the tile's kind
  const uint32_t last = DepthLattice(bounds.depth).last();
  ASSERT_EQ(bytes[base] | bytes[base + 1] << 8 | bytes[base + 2] << 16, static_cast<int>(last));
  ++bytes[base];
  EXPECT_NE(refusal(bytes).find("tile 0, 0"), std::string::npos);
}

std::string refusal_of(const std::vector<uint8_t>& bytes, const DepthImage& bounded) {
  const auto image = decode_refinement(bytes, bounded);
  return image.ok() ? "" : image.error().text;
}

TEST(Refinement, Headers) {
  const DepthImage nothing(30, 20);
  const auto bytes = encode_refinement(nothing, nothing);
  EXPECT_EQ(bytes, (std::vector<uint8_t>{0xD8, 11, 30, 20}));
  EXPECT_EQ(refusal_of(bytes, nothing), "");
  EXPECT_NE(refusal_of({}, nothing).find("shorter than its header"), std::string::npos);
  EXPECT_NE(refusal_of({0xD8, 11, 30}, nothing).find("shorter than its header"), std::string::npos);
  EXPECT_NE(refusal_of({0xD7, 12, 30, 20}, nothing).find("begins with 0xd7"), std::string::npos);
  EXPECT_NE(refusal_of({0xD8, 4, 30, 20}, nothing).find("version 4, expected 11"), std::string::npos);
  EXPECT_NE(refusal_of({0xD8, 11, 30, 21}, nothing).find("30 x 21 pixels, expected 30 x 20"), std::string::npos);
  EXPECT_NE(refusal_of({0xD8, 11, 30, 20, 0}, nothing).find("1 bytes after its end"), std::string::npos);
}

TEST(Refinement, OfWhatIsExactTakesAByteATile) {
  const DepthImage image = test::render({.width = 600, .height = 300});
  const auto bytes = encode_refinement(image, image);
  EXPECT_LE(bytes.size(), 6u + 3 * 2);
  EXPECT_TRUE(decode_refinement(bytes, image).value() == image);
}

// A refinement need not start from a bounded image: any image that covers the same pixels will do.
TEST(Refinement, OfAnyOtherImage) {
  for (const double density : {0.05, 0.6, 1.0}) {
    const DepthImage exact = test::random_pixels(70, 50, density, 3);
    DepthImage other = exact;
    for (size_t i = 0; i < other.pixels(); ++i)
      if (other.depth[i] != 0)
        other.depth[i] = static_cast<uint32_t>(1 + i * 7919 % image::kMaxDepthCode), other.colour[i] ^= 0x818181;
    EXPECT_TRUE(decode_refinement(encode_refinement(exact, other), other).value() == exact) << density;
  }
}

TEST(Refinement, EveryKindOfATile) {
  const DepthImage image = test::render({.width = 60, .height = 50});
  const DepthImage bounded = decode(encode(image, error_bounds(1 / 32.0, 2 / 1280.0, 1, 1))).value();
  auto bytes = encode_refinement(image, bounded);
  ASSERT_EQ(bytes[4], 1) << "scattered, after mark, version and size";
  for (int kind = 2; kind < 256; ++kind) {
    bytes[4] = static_cast<uint8_t>(kind);
    EXPECT_NE(refusal_of(bytes, bounded), "") << kind;
  }
}

TEST(Refinement, OfAnotherMaskIsRefusedOrKeepsIt) {
  const DepthImage image = test::render({.width = 90, .height = 70});
  const ErrorBounds bounds = error_bounds(1 / 32.0, 2 / 1280.0, 1, 1);
  for (const double density : {0.05, 0.5, 0.9}) {
    DepthImage masked = image;
    test::keep_random(masked, density, 3);
    const DepthImage bounded = decode(encode(masked, bounds)).value();
    const auto of_all = encode_refinement(image, decode(encode(image, bounds)).value());
    const auto result = decode_refinement(of_all, bounded);
    if (!result.ok()) continue;
    for (size_t i = 0; i < image.pixels(); ++i) ASSERT_EQ(result->depth[i] == 0, bounded.depth[i] == 0);
  }
}

TEST(Refinement, CostsLessThanTheImageAnew) {
  const DepthImage image = test::render({.width = 256, .height = 256, .rough = true});
  const auto bytes = encode(image, error_bounds(1 / 32.0, 2 / 1280.0, 1, 1));
  const auto refinement = encode_refinement(image, decode(bytes).value());
  EXPECT_LT(bytes.size() * 10, encode(image).size() * 7);
  EXPECT_LT(refinement.size() * 10, encode(image).size() * 8);
}

// A change of the format changes its version, docs/codec.md, docs/protocol.md and these bytes.
void expect_bytes(const DepthImage& image, const std::vector<uint8_t>& bytes, const std::vector<uint8_t>& refinement) {
  DepthImage bounded;
  EXPECT_EQ(encode(image, error_bounds(1 / 32.0, 2 / 1280.0, 1, 1), &bounded), bytes);
  EXPECT_EQ(encode_refinement(image, bounded), refinement);
  const auto decoded = decode(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.error().text;
  EXPECT_TRUE(*decoded == bounded);
  const auto exact = decode_refinement(refinement, bounded);
  ASSERT_TRUE(exact.ok()) << exact.error().text;
  EXPECT_TRUE(*exact == image);
}

TEST(ErrorBounds, NormalsWithABoundAreTurned) {
  DepthImage image(9, 8);
  for (size_t i = 0; i < image.pixels(); i += 9) image.depth[i] = 500000, image.normal[i] = 0x7F7F;
  auto bytes = encode(image, {.normal = 1});
  const size_t mask = 5 + 1 + 2 + 1 + 8;  // header, bounds, the tile's kind, its base
  const size_t pole = mask + 1 + bytes[mask] / 2;
  ASSERT_EQ(bytes[pole], 4) << "the map's middle";
  ASSERT_EQ(refusal(bytes), "");
  bytes[pole] = 6;
  EXPECT_NE(refusal(bytes), "");
}

TEST(CodecFormat, GoldenBytesOfASparseTileWithinBounds) {
  DepthImage image(9, 8);
  for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {8, 1}, {1, 3}, {5, 3}, {7, 4}, {2, 6}, {3, 7}, {8, 7}}) {
    const size_t i = static_cast<size_t>(y * 9 + x);
    image.depth[i] = static_cast<uint32_t>(500000 + 1234 * x - 777 * y + x * x * y);
    image.colour[i] = 0x405060 + static_cast<uint32_t>(x) * 0x030201;
    image.normal[i] = static_cast<uint16_t>((150 + 2 * x) % 256 | (100 - y) << 8);
  }
  expect_bytes(image, {215, 12,  1,   9,  8,   179, 230, 12,  1,   1,   6,   87,  206, 0,  96,  80,
                       64,  150, 100, 16, 163, 15,  186, 98,  90,  36,  93,  192, 4,   69, 129, 254,
                       239, 53,  221, 2,  180, 57,  248, 197, 119, 198, 145, 198, 101, 32, 4},
               {216, 11,  9,   8,  1, 182, 162, 7,   16, 1, 25, 155, 38,  193, 151, 46, 0,   30, 17, 7,   21, 108,
                110, 210, 128, 18, 0, 0,   111, 128, 18, 0, 25, 151, 242, 34,  0,   25, 143, 10, 10, 164, 39, 128});
}

TEST(CodecFormat, GoldenBytesOfADenseTileWithinBounds) {
  DepthImage image(17, 3);
  for (size_t i = 0; i < image.pixels(); ++i) {
    const int x = static_cast<int>(i % 17), y = static_cast<int>(i / 17);
    image.depth[i] = static_cast<uint32_t>(600000 + 900 * x - 700 * y + x * x * y);
    image.colour[i] = 0x102030 + static_cast<uint32_t>(i % 4) * 0x010203;
    image.normal[i] = static_cast<uint16_t>(0x8040 + x * y);
  }
  expect_bytes(
      image,
      {215, 12,  1,   17,  3,   179, 230, 12,  1,   1,   1,   163, 213, 0,   48,  32,  16,  64,  128, 5,   48,  0,
       128, 201, 39,  254, 148, 219, 0,   0,   0,   0,   0,   0,   0,   0,   240, 129, 15,  244, 159, 61,  124, 58,
       5,   183, 175, 3,   0,   0,   0,   0,   0,   0,   192, 199, 245, 245, 123, 0,   16,  232, 65,  163, 51,  170,
       170, 170, 170, 25,  100, 0,   0,   200, 63,  244, 146, 225, 170, 194, 223, 9,   148, 203, 136, 170, 170, 0,
       0,   200, 81,  181, 170, 170, 0,   30,  6,   248, 248, 227, 31,  135, 136, 65,  196, 32,  98,  1,   64,  240,
       128, 127, 231, 242, 218, 99,  118, 107, 173, 181, 214, 90,  107, 173, 181, 6,   5,   0,   1,   18,  166, 149,
       129, 94,  87,  33,  182, 8,   63,  126, 8,   30,  104, 39,  0,   189, 138, 249, 31,  145, 89,  97,  59,  1,
       180, 0,   0,   169, 215, 0,   0,   55,  18,  34,  94,  129, 186, 136, 22,  255, 112, 3,   0},
      {216, 11,  17,  3,   1,   239, 207, 12,  16,  0,   157, 1,   231, 99,  247, 231, 99,
       123, 200, 123, 249, 40,  116, 127, 232, 58,  243, 201, 252, 63,  157, 235, 75,  102,
       14,  157, 253, 245, 98,  35,  254, 229, 147, 171, 160, 134, 105, 160, 138, 59,  1,
       62,  8,   8,   14,  242, 66,  142, 39,  152, 115, 42,  232, 238, 96,  146, 160});
}

}  // namespace
}  // namespace telesplat::codec
