// Estimates another machine's clock from exchanges of messages.
#include "common/net/master_link.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace telesplat::net {
namespace {

// The other clock: ahead by offset_s at 0, faster by drift.
struct Clocks {
  double offset_s = 0, drift = 0;
  double there(double here_s) const { return here_s + offset_s + drift * here_s; }
  ClockExchange exchange(double sent_s, double to_s, double work_s, double back_s) const {
    return {sent_s, there(sent_s + to_s), there(sent_s + to_s + work_s), sent_s + to_s + work_s + back_s};
  }
};

TEST(ClockEstimate, KnowsNothingAtFirst) {
  const ClockEstimate e;
  EXPECT_FALSE(e.known());
  EXPECT_EQ(e.offset_s(5), 0);
  EXPECT_TRUE(std::isinf(e.error_s(5)));
  EXPECT_EQ(e.round_trip_s(), 0);
}

TEST(ClockEstimate, EqualWaysTellTheOffsetExactly) {
  ClockEstimate e;
  e.add(Clocks{1000}.exchange(7, 0.02, 0.5, 0.02));
  EXPECT_NEAR(e.offset_s(7.04), 1000, 1e-4);
  EXPECT_NEAR(e.error_s(7.27), 0.02, 1e-4) << "half the round trip; what the other machine works counts for nothing";
  EXPECT_NEAR(e.round_trip_s(), 0.04, 1e-9);
}

// Queues lengthen single ways, at random and by far; the shortest round trip is near the truth all the same.
TEST(ClockEstimate, TheErrorIsNeverBeyondWhatItSays) {
  std::mt19937 random(7);
  std::exponential_distribution<double> queue(1 / 0.01);
  for (const double offset_s : {-12.5, 0.003, 4000.0}) {
    for (const double drift : {-80e-6, 0.0, 50e-6}) {
      const Clocks clocks{offset_s, drift};
      ClockEstimate e;
      for (int i = 0; i < 400; ++i) {
        const double now_s = i;
        e.add(clocks.exchange(now_s, 0.0002 + queue(random), 1e-5, 0.0002 + queue(random)));
        for (const double later_s : {0.3, 2.0}) {
          const double t = now_s + later_s, truth_s = clocks.there(t) - t;
          EXPECT_LE(std::abs(e.offset_s(t) - truth_s), e.error_s(t)) << "after " << i << " exchanges";
        }
      }
      EXPECT_LT(e.error_s(400), 0.005);
      EXPECT_NEAR(e.drift(), drift, 20e-6);
    }
  }
}

TEST(ClockEstimate, DriftIsFollowedBetweenExchanges) {
  const Clocks clocks{5, 100e-6};
  ClockEstimate e;
  for (int i = 0; i < 60; ++i) e.add(clocks.exchange(i, 1e-4, 0, 1e-4));
  EXPECT_NEAR(e.drift(), 100e-6, 2e-6);
  EXPECT_NEAR(e.offset_s(80), clocks.there(80) - 80, 1e-4) << "20 s after the last: 2 ms without it";
}

TEST(ClockEstimate, IgnoresWhatCannotBe) {
  ClockEstimate e;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  e.add({1, 5, 5, 0.5});  // answered before it was asked
  e.add({1, 5, 7, 1.5});  // the work took longer than the whole exchange
  e.add({1, 7, 5, 1.5});  // answered before it arrived
  e.add({1, nan, 5, 1.5});
  EXPECT_FALSE(e.known());
  e.add({1, 5, 5, 1.5});
  EXPECT_TRUE(e.known());
  e.clear();
  EXPECT_FALSE(e.known());
}

TEST(ClockEstimate, OneClockHasNoError) {
  ClockEstimate e;
  e.add(Clocks{0}.exchange(1, 0.3, 0, 0.1));
  e.same_clock();
  EXPECT_EQ(e.offset_s(2), 0);
  EXPECT_EQ(e.error_s(2), 0);
  EXPECT_NEAR(e.round_trip_s(), 0.4, 1e-9);
}

}  // namespace
}  // namespace telesplat::net
