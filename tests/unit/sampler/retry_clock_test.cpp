// A chunk that is still coming over a slow link is not asked for again.
#include "services/sampler/retry_clock.h"

#include <gtest/gtest.h>

namespace telesplat::sampler {
namespace {

TEST(RetryClock, WaitsAsLongAsTheLinkNeeds) {
  RetryClock clock;
  EXPECT_FALSE(clock.overdue(1e9, false)) << "nothing was asked for";
  clock.asked(3'000'000, 10);
  EXPECT_FALSE(clock.overdue(10 + 0.99 * RetryClock::kFirst_s, false)) << "nothing is known of the link";
  EXPECT_TRUE(clock.overdue(10 + 1.01 * RetryClock::kFirst_s, false));
  EXPECT_TRUE(clock.overdue(12.1, true)) << "what was on a broken connection is lost";
  EXPECT_FALSE(clock.overdue(11.9, true));
  // 1 Mbit/s.
  clock.answered(3'000'000, 3'000'000, 34);
  EXPECT_FALSE(clock.overdue(1e9, false));
  clock.asked(3'000'000, 34);
  EXPECT_GE(clock.patience_s(), 2 * 24);
  // 1 Gbit/s.
  for (int i = 0; i < 50; ++i) {
    clock.answered(3'000'000, 3'000'000, 34 + 0.024 * (i + 1) + 30);
    clock.asked(3'000'000, 34 + 0.024 * (i + 1) + 30);
  }
  EXPECT_LT(clock.patience_s(), 10);
  clock.forget();
  EXPECT_FALSE(clock.overdue(1e9, true));
}

TEST(RetryClock, ProgressRenewsPatience) {
  RetryClock clock;
  for (int i = 0; i < 8; ++i) clock.asked(1'000'000, 0);  // 8 Mbit/s
  for (int i = 1; i <= 8; ++i) {
    EXPECT_FALSE(clock.overdue(i, false)) << i;
    clock.answered(1'000'000, 1'000'000, i);
  }
  EXPECT_NEAR(clock.patience_s(), RetryClock::kLeast_s, 1e-9) << "all is there";
  clock.asked(0, 9);
  EXPECT_TRUE(clock.overdue(11.1, false)) << "what is small and does not come was lost";
}

}  // namespace
}  // namespace telesplat::sampler
