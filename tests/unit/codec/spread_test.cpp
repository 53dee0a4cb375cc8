// Numbers predicted to a 16th: any number comes back, and its cost follows from the spread.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/codec/sparse/spread.h"

namespace telesplat::codec {
namespace {

using detail::BitCoder;
using detail::BitDecoder;
using detail::RangeDecoder;
using detail::RangeEncoder;
using detail::SpreadModel;
using detail::SpreadShares;

struct Number {
  int64_t residual;
  int rounding, scale;  // 256ths
};

std::vector<uint8_t> encoded(const std::vector<Number>& numbers) {
  std::vector<uint8_t> bytes;
  RangeEncoder coder(bytes);
  SpreadModel model;
  model.start();
  for (const Number& n : numbers)
    EXPECT_EQ(model.code(BitCoder{coder}, n.residual, n.rounding, n.scale), n.residual) << n.scale;
  coder.finish();
  return bytes;
}

void expect_back(const std::vector<Number>& numbers) {
  const auto bytes = encoded(numbers);
  RangeDecoder coder(bytes);
  SpreadModel model;
  model.start();
  for (const Number& n : numbers) {
    ASSERT_EQ(model.code(BitDecoder{coder}, 0, n.rounding, n.scale), n.residual) << n.scale << " " << n.rounding;
  }
  EXPECT_TRUE(coder.finished());
}

TEST(Spread, LogarithmsRiseInEighths) {
  for (uint32_t v = 1; v < 4096; ++v) {
    ASSERT_LE(detail::log8(v), detail::log8(v + 1)) << v;
    ASSERT_NEAR(detail::log8(v), 8 * std::log2(v), 1.7) << v;
  }
  EXPECT_EQ(detail::log8(1), 0);
  EXPECT_EQ(detail::log8((1u << 29) - 1), 231);
  EXPECT_EQ(detail::error_log(0), 24);
  EXPECT_EQ(detail::error_log(INT64_MAX), detail::error_log(-INT64_MAX));
}

TEST(Spread, PlacesFollowOneAnother) {
  for (int scale = 0; scale <= SpreadShares::kMostScale; ++scale)
    for (int rounding = 0; rounding < 16; ++rounding) {
      const SpreadShares shares(scale, rounding);
      EXPECT_EQ(shares.begin(0), 0u);
      EXPECT_EQ(shares.begin(shares.places()), SpreadShares::kAll);
      for (int place = 0; place < shares.places(); ++place) {
        ASSERT_LT(shares.begin(place), shares.begin(place + 1)) << scale << " " << rounding << " " << place;
        ASSERT_LE(std::abs(shares.wider(place)), 256);
      }
      for (int64_t cell = -shares.reach(); cell <= shares.reach(); ++cell)
        ASSERT_EQ(shares.place(cell), cell + shares.reach() + 1);
      EXPECT_EQ(shares.place(-shares.reach() - 1), 0);
      EXPECT_EQ(shares.place(int64_t{1} << 40), shares.places() - 1);
    }
}

// Probability of a cell by Student's distribution function with 3 degrees of freedom.
TEST(Spread, SharesAreStudents) {
  const auto below = [](double x) { return 0.5 + (x / (1 + x * x) + std::atan(x)) / std::numbers::pi; };
  for (const int scale : {0, 20, 41, 56})
    for (const int rounding : {0, 5, 8, 15}) {
      const SpreadShares shares(scale, rounding);
      const double spread = std::exp2(scale / 8.0);
      for (int cell = -shares.reach(); cell <= shares.reach(); ++cell) {
        const int place = shares.place(cell);
        const double share = below((16 * cell + 16 - rounding) / spread) - below((16 * cell - rounding) / spread);
        ASSERT_NEAR((shares.begin(place + 1) - shares.begin(place)) / 65536.0, share, 0.005)
            << scale << " " << rounding << " " << cell;
      }
    }
}

TEST(Spread, AnyNumberComesBackWhateverWasExpected) {
  std::mt19937_64 random(3);
  for (const int most : {0, 2, 9, 25}) {
    std::vector<Number> numbers;
    for (int i = 0; i < 5000; ++i) {
      const auto residual = static_cast<int64_t>(random() % (uint64_t{2} << most)) - (int64_t{1} << most);
      numbers.push_back(
          {residual, static_cast<int>(random() % 16), static_cast<int>(random() % (300 << 8)) - (30 << 8)});
    }
    expect_back(numbers);
  }
  expect_back({});
}

// Wrong scales are corrected.
TEST(Spread, ScalesAreCorrected) {
  std::mt19937 random(5);
  std::student_t_distribution<double> student(3);
  const auto bits = [&](double spread, int scale) {
    std::vector<Number> numbers;
    for (int i = 0; i < 4000; ++i)
      numbers.push_back({std::lround(student(random) * spread / std::sqrt(3.0)), 8, scale});
    return 8.0 * static_cast<double>(encoded(numbers).size()) / 4000;
  };
  const auto scale_of = [](double spread) { return static_cast<int>(256 * 8 * std::log2(16 * spread)); };
  for (const double spread : {0.4, 3.0, 50.0, 3000.0}) {
    const double right = bits(spread, scale_of(spread));
    EXPECT_LT(bits(spread, scale_of(spread * 8)), right + 0.15) << spread;
    EXPECT_LT(bits(spread, scale_of(spread / 8)), right + 0.15) << spread;
    if (spread >= 3) {
      // The distribution's entropy, and the cost of cells and their shares.
      EXPECT_NEAR(right, std::log2(spread / std::sqrt(3.0)) + 1.7735 / std::numbers::ln2, 0.1) << spread;
    }
  }
}

TEST(Spread, NoBytesGiveMoreThanCanBeTold) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    std::vector<uint8_t> bytes(random() % 100);
    for (uint8_t& b : bytes) b = static_cast<uint8_t>(round % 2 == 0 ? 255 : random());
    RangeDecoder coder(bytes);
    SpreadModel model;
    model.start();
    for (int i = 0; i < 300; ++i) {
      const int64_t n = model.code(BitDecoder{coder}, 0, i % 16, static_cast<int>(random() % (260 << 8)));
      ASSERT_LT(std::abs(n), int64_t{1} << 50);
    }
  }
}

}  // namespace
}  // namespace telesplat::codec
