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

}  // namespace
}  // namespace telesplat::tools
