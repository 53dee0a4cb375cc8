// Colours by height of scattered pixels: their cost, and the effect of a damaged axis.
#include "common/codec/sparse/ramp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using detail::Ramp;
using detail::RampAxis;

// Pixels look along (x / 200 - 0.64, 0.3 - y / 200, -1), from a head that looks 30 degrees down.
RoomAxes axes_of_view() {
  const double c = std::cos(std::numbers::pi / 6), s = std::sin(std::numbers::pi / 6);
  return {{{1 / 200.0, 0, -0.64}, {0, -c / 200, 0.3 * c - s}, {0, -s / 200, 0.3 * s + c}}};
}

// Hilly ground in pixel (x, y): its depth code and its height, -0.5 to -0.4.
struct Ground {
  uint32_t code;
  double height;
};
Ground ground(int x, int y) {
  const auto axes = axes_of_view();
  const auto along = [&](size_t i) { return axes[i][0] * x + axes[i][1] * y + axes[i][2]; };
  double depth = 1;
  for (int step = 0; step < 30; ++step) {
    const double want = -0.45 + 0.05 * std::sin(9 * along(0) * depth) * std::cos(11 * along(2) * depth);
    depth += 0.5 * (want / std::min(along(1), -0.05) - depth);
  }
  const auto code = static_cast<uint32_t>(std::lround(1e6 / depth));
  return {code, along(1) * 1e6 / code};
}

template <class Colour>
image::DepthImage scattered(Colour colour_of) {
  const image::PixelMask mask = test::random_mask(256, 256, 2000.0 / 65536, 5);
  image::DepthImage image(256, 256);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      if (!mask.at(x, y)) continue;
      const auto i = static_cast<size_t>(256 * y + x);
      const Ground g = ground(x, y);
      image.depth[i] = g.code;
      image.colour[i] = colour_of(g.height, i);
    }
  return image;
}

// Colours that change with height, up and down, like a terrain's.
uint32_t tint(double height, size_t) {
  const double t = (height + 0.5) / 0.1;
  const auto channel = [](double v) { return static_cast<uint32_t>(std::lround(std::clamp(v, 0.0, 1.0) * 255)); };
  return channel(0.2 + 0.7 * t) << 16 | channel(0.5 + 0.4 * std::sin(7 * t)) << 8 |
         channel(0.3 + 0.3 * std::cos(5 * t));
}

TEST(Ramp, ColoursByHeightTakeFewBits) {
  const image::DepthImage tinted = scattered(tint), grey = scattered([](double, size_t) { return 0x808080u; });
  const auto without = encode(tinted), with = encode(tinted, {}, nullptr, axes_of_view()), none = encode(grey);
  EXPECT_EQ(decode(without).value(), tinted);
  EXPECT_EQ(decode(with).value(), tinted);
  EXPECT_EQ(encode(grey, {}, nullptr, axes_of_view()), none) << "one colour says nothing of heights";
  const auto bits = [&](const auto& bytes) { return 8.0 * static_cast<double>(bytes.size() - none.size()) / 2000; };
  EXPECT_LT(bits(with), 3);
  EXPECT_GT(bits(without), bits(with) + 1);
}

TEST(Ramp, WithinBoundsOfErrorToo) {
  const image::DepthImage tinted = scattered(tint);
  const ErrorBounds bounds{.depth = 1u << 18, .normal = 1, .colour = 2};
  image::DepthImage told;
  const auto bytes = encode(tinted, bounds, &told, axes_of_view());
  const auto back = decode(bytes).value();
  EXPECT_EQ(back, told);
  EXPECT_LT(bytes.size(), encode(tinted, bounds).size() + 8);
  for (size_t i = 0; i < tinted.pixels(); ++i)
    for (int shift = 0; shift < 24; shift += 8)
      ASSERT_LE(std::abs(int(tinted.colour[i] >> shift & 255) - int(back.colour[i] >> shift & 255)), 2);
  EXPECT_EQ(decode_refinement(encode_refinement(tinted, back), back).value(), tinted);
}

// Nearly every pixel has its own colour: any heights could be an order for them.
TEST(Ramp, ColoursThatHaveNothingToDoWithHeightCostNoMore) {
  const image::DepthImage any = scattered([](double, size_t i) { return static_cast<uint32_t>(i * 2654435761u >> 8); });
  EXPECT_EQ(encode(any, {}, nullptr, axes_of_view()), encode(any));
}

TEST(Ramp, AxesThatAreNoneSayNothing) {
  const image::DepthImage tinted = scattered(tint);
  for (const double bad : {double(NAN), HUGE_VAL, 1e300}) {
    RoomAxes axes = axes_of_view();
    axes[1][2] = bad;
    EXPECT_EQ(encode(tinted, {}, nullptr, axes), encode(tinted));
  }
}

TEST(Ramp, SaysWhatIsKnownAboutAHeight) {
  Ramp ramp;
  ramp.start({}, 10, 10);
  EXPECT_EQ(ramp.at(100).gap, Ramp::kNothing);
  ramp.add(1000, 0x102030);
  EXPECT_EQ(ramp.at(1000).colour, 0x102030u);
  EXPECT_EQ(ramp.at(1001).gap, 0u) << "the same eight heights";
  EXPECT_EQ(ramp.at(0).colour, 0x102030u);
  EXPECT_EQ(ramp.at(RampAxis::kMost).colour, 0x102030u);
  ramp.add(2000, 0x302010);
  EXPECT_EQ(ramp.at(1500).colour, 0x202020u) << "half of the way";
  EXPECT_EQ(ramp.at(1999).colour, 0x302010u);
  EXPECT_LT(ramp.at(1500).gap, ramp.at(9000).gap);
  ramp.start({}, 10, 10);
  EXPECT_EQ(ramp.at(1000).gap, Ramp::kNothing) << "of another tile";
}

TEST(Ramp, AnAxisThatNoSumHoldsIsRefused) {
  const auto axis = [](RampAxis of, int width, int height) {
    std::vector<uint8_t> bytes;
    put_ramp(bytes, of);
    detail::Reader in(bytes);
    return get_ramp(in, width, height).has_value();
  };
  constexpr int32_t kLarge = 1 << 30;
  EXPECT_TRUE(axis({kLarge, kLarge, 5, -7, RampAxis::kMostShift}, 256, 255));
  EXPECT_FALSE(axis({kLarge, kLarge, 5, -7, RampAxis::kMostShift}, 256, 257));
  EXPECT_FALSE(axis({INT32_MIN, 0, 0, 0, 0}, 65536, 1));
  EXPECT_FALSE(axis({1, 1, 1, 0, RampAxis::kMostShift + 1}, 10, 10));
  std::vector<uint8_t> bytes(16);
  detail::Reader in(bytes);
  EXPECT_FALSE(detail::get_ramp(in, 10, 10)) << "17 are needed";
}

TEST(Ramp, HeightsAreRoundedDownOnBothSidesOfZero) {
  const RampAxis axis{.a = 1, .b = 0, .c = 0, .low = -10, .shift = 0};
  EXPECT_EQ(axis.height(7, 0, 2), 13);
  EXPECT_EQ(axis.height(-7, 0, 2), 6);
  EXPECT_EQ(axis.height(-6, 0, 2), 7);
  EXPECT_EQ(axis.height(-100, 0, 2), 0);
  EXPECT_EQ(axis.height(30000, 0, 1), RampAxis::kMost);
}

// The axis comes from floating point, which must be the same on all machines: so must these bytes.
TEST(Ramp, TheBytesAreTheSameEverywhere) {
  const auto digest = [](const std::vector<uint8_t>& bytes) {
    uint64_t sum = 0xcbf29ce484222325;  // FNV-1a
    for (const uint8_t b : bytes) sum = (sum ^ b) * 0x100000001b3;
    return sum;
  };
  const image::DepthImage tinted =
      scattered([](double height, size_t i) { return tint(std::round(height * 4096) / 4096, i); });
  EXPECT_EQ(digest(encode(tinted, {}, nullptr, axes_of_view())), 3183573671440488936u);
  EXPECT_EQ(digest(encode(tinted)), 12963383931042470156u);
}

}  // namespace
}  // namespace telesplat::codec
