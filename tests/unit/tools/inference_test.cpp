// Intervals and tests, against SciPy 1.10 and closed forms.
#include "tools/common/inference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

namespace telesplat::tools {
namespace {

using Values = std::vector<double>;

TEST(Inference, MeansHaveStudentsIntervals) {
  const auto found = mean_interval(Values{16.7, 17.2, 16.9});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->low, 16.308172385372245, 1e-9);  // scipy.stats.t.interval(0.95, 2, mean, sem)
  EXPECT_NEAR(found->high, 17.558494281294422, 1e-9);
  EXPECT_FALSE(mean_interval(Values{16.7}));
}

TEST(Inference, TwoSetsAreHeldAgainstEachOtherByWelch) {
  const auto d = difference(Values{16.7, 17.2, 16.9}, Values{18.1, 17.6, 18.9, 18.3});
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->mean, 1.2916666666666667, 1e-9);
  EXPECT_NEAR(d->p, 0.010723074231045375, 1e-9);  // scipy.stats.ttest_ind(equal_var=False)
  EXPECT_NEAR(d->interval.low, 0.4752914, 1e-6);
  EXPECT_NEAR(d->interval.high, 2.1080420, 1e-6);
  EXPECT_NEAR(difference(Values{10, 11}, Values{10.2, 13.1})->p, 0.5700540153771092, 1e-9);
  EXPECT_FALSE(difference(Values{10, 11}, Values{10}));
  EXPECT_EQ(difference(Values{10, 10}, Values{10, 10})->p, 1);
  EXPECT_EQ(difference(Values{10, 10}, Values{11, 11})->p, 0) << "nothing varies";
}

TEST(Inference, SeveralComparisonsRaiseTheirP) {
  const auto p = holm({0.01, 0.04, 0.03, 0.005});
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(p[i], (std::array{0.03, 0.06, 0.06, 0.02})[i], 1e-12) << i;
  EXPECT_EQ(holm({0.9, 0.8}), (Values{1, 1}));
}

// x(i) = r x(i - 1) + noise: its median is 0.
Values series(size_t n, double r, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise;
  Values out{noise(random)};
  while (out.size() < n) out.push_back(r * out.back() + noise(random));
  return out;
}

TEST(Inference, BlocksAreAsLongAsValuesDependOnEachOther) {
  EXPECT_EQ(block_length(Values(1000, 5.0)), 10u) << "the cube root";
  // sqrt(6) 0.9 / (1 - 0.81) = 11.6; its 2/3rd power is 5.13.
  EXPECT_NEAR(double(block_length(series(8000, 0.9, 1))), 20 * 5.13, 15);
  Values rises;
  for (int i = 0; i < 100; ++i) rises.push_back(i);
  EXPECT_EQ(block_length(rises), 25u) << "a quarter at most";
}

TEST(Inference, BlocksCoverTheTruthWhereNeighboursDepend) {
  const std::array shares{0.5, 0.95};
  int covered = 0, covered_alone = 0;
  constexpr int kSeries = 60;
  for (int i = 0; i < kSeries; ++i) {
    Values values = series(600, 0.8, uint64_t(i) + 1);
    const auto blocks = block_intervals(values, shares);
    ASSERT_EQ(blocks.size(), 2u);
    covered += blocks[0].low <= 0 && 0 <= blocks[0].high;
    std::shuffle(values.begin(), values.end(), std::mt19937_64(uint64_t(i)));  // as if they did not depend
    const auto alone = block_intervals(values, shares)[0];
    covered_alone += alone.low <= 0 && 0 <= alone.high;
  }
  EXPECT_GE(covered, kSeries * 82 / 100) << "95 % is what they promise of long series";
  EXPECT_LE(covered_alone, kSeries * 75 / 100) << "else blocks would not be needed";
}

TEST(Inference, FewValuesHaveNoBlocks) {
  EXPECT_TRUE(block_intervals(Values(kLeastForBlocks - 1, 1.0), std::array{0.5}).empty());
  const auto same = block_intervals(Values(kLeastForBlocks, 7.0), std::array{0.5});
  EXPECT_EQ(same[0].low, 7);
  EXPECT_EQ(same[0].high, 7);
}

}  // namespace
}  // namespace telesplat::tools
