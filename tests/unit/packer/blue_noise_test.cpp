// Picks of pixels: each comes in turn, and each set is spread evenly.
#include "services/packer/points/plan/validation.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <set>

namespace telesplat::packer {
namespace {

constexpr int kSide = BlueNoise::kSide;

using Pixels = std::vector<std::pair<int, int>>;

Pixels picked(const BlueNoise& noise, uint64_t round) {
  Pixels out;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      if (noise.picks(x, y, round)) out.emplace_back(x, y);
  return out;
}

// Distances of each pixel to the nearest other one, on the torus: their mean and their least.
std::pair<double, double> spacing(const Pixels& pixels) {
  double sum = 0, least = kSide;
  for (const auto& a : pixels) {
    double nearest = kSide;
    for (const auto& b : pixels) {
      if (a == b) continue;
      const auto apart = [](int p, int q) { return std::min(std::abs(p - q), kSide - std::abs(p - q)); };
      nearest = std::min(nearest, std::hypot(apart(a.first, b.first), apart(a.second, b.second)));
    }
    sum += nearest, least = std::min(least, nearest);
  }
  return {sum / static_cast<double>(pixels.size()), least};
}

TEST(BlueNoise, RanksAreAPermutation) {
  const auto& ranks = blue_noise_ranks();
  EXPECT_EQ(std::set<uint16_t>(ranks.begin(), ranks.end()).size(), ranks.size());
  EXPECT_EQ(*std::max_element(ranks.begin(), ranks.end()), ranks.size() - 1);
}

TEST(BlueNoise, EveryPixelIsPickedOnceInAsManyRoundsAsTheShare) {
  for (const int share : {1, 2, 7, 32, 100, 4096}) {
    const BlueNoise noise(share);
    std::vector<int> times(size_t{kSide} * kSide);
    for (int round = 1000; round < 1000 + share; ++round) {
      const Pixels pixels = picked(noise, static_cast<uint64_t>(round));
      EXPECT_NEAR(static_cast<double>(pixels.size()), 4096.0 / share, 1) << share;
      for (const auto& [x, y] : pixels) ++times[static_cast<size_t>(y * kSide + x)];
    }
    for (const int n : times) EXPECT_EQ(n, 1);
  }
}

TEST(BlueNoise, RowsAreThePicksOfAllSquares) {
  const BlueNoise noise(32);
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) EXPECT_EQ(noise.picks(x, y, 5), (noise.row(y % 64, 5 + 32) >> (x % 64) & 1) != 0);
}

TEST(BlueNoise, SharesOutsideTheRangeAreBroughtIntoIt) {
  EXPECT_EQ(BlueNoise(0).share(), 1);
  EXPECT_EQ(BlueNoise(-5).share(), 1);
  EXPECT_EQ(BlueNoise(1 << 30).share(), 4096);
}

// Random pixels are 2.8 pixels from their nearest neighbour on average, and some touch; a hexagonal grid has 6.1.
TEST(BlueNoise, EverySetIsSpreadEvenly) {
  const BlueNoise noise(32);
  double worst = kSide, sum = 0;
  for (uint64_t round = 0; round < 32; ++round) {
    const auto [mean, least] = spacing(picked(noise, round));
    worst = std::min(worst, mean), sum += mean;
    EXPECT_GE(least, 1.4) << round;
  }
  RecordProperty("mean", std::to_string(sum / 32));
  EXPECT_GT(sum / 32, 4.0);
  EXPECT_GT(worst, 3.5);
}

}  // namespace
}  // namespace telesplat::packer
