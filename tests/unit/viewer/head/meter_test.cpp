// Errors of predictions, and other programs' clocks.
#include <gtest/gtest.h>

#include <cmath>

#include "client/viewer/tracking/prediction_meter.h"

namespace telesplat::tracking {
namespace {

geometry::Pose at_x(double x) { return {{x, 0, 0}, {1, 0, 0, 0}}; }

TEST(PredictionMeter, ComparesWithWhereTheHeadWasThen) {
  PredictionMeter meter;
  meter.actual(0, at_x(0));
  meter.predicted(0, at_x(0), 0.05, at_x(0.04));
  EXPECT_EQ(meter.figures().count, 0u);
  meter.actual(0.1, at_x(0.1));  // so the head was at 0.05 then
  const auto f = meter.figures();
  EXPECT_EQ(f.count, 1u);
  EXPECT_NEAR(f.horizon_s, 0.05, 1e-12);
  EXPECT_NEAR(f.error_m, 0.01, 1e-12);
  EXPECT_NEAR(f.unpredicted_m, 0.05, 1e-12);
  EXPECT_NEAR(f.error_rad, 0, 1e-12);
}

TEST(PredictionMeter, DoesNotJudgeWhatNobodyKnows) {
  PredictionMeter meter;
  meter.predicted(0, at_x(0), 0.05, at_x(0));
  meter.actual(0.1, at_x(1));  // no earlier pose is known
  meter.predicted(0.1, at_x(1), 0.2, at_x(1));
  meter.actual(5, at_x(2));  // no pose between is known
  EXPECT_EQ(meter.figures().count, 0u);
}

TEST(PredictionMeter, KeepsNoMoreThanItMay) {
  PredictionMeter meter;
  meter.actual(0, at_x(0));
  for (int i = 0; i < 10'000; ++i) meter.predicted(0, at_x(0), 0.1, at_x(0));
  meter.actual(0.1, at_x(0));
  EXPECT_EQ(meter.figures().count, PredictionMeter::kMostWaiting);
}

TEST(PoseClock, TakesTheLeastDelay) {
  PoseClock clock;
  // Their clock is 100 s behind; messages take 5 to 25 ms.
  double worst = 0;
  for (int i = 0; i < 500; ++i) {
    const double t_s = i * 0.01, arrived_s = t_s + 100.005 + 0.02 * std::abs(std::sin(i * 1.7));
    const double local_s = clock.local_s(t_s, arrived_s);
    EXPECT_LE(local_s, arrived_s);
    if (i > 50) worst = std::max(worst, std::abs(local_s - t_s - 100.005));
  }
  EXPECT_LT(worst, 0.002);
}

TEST(PoseClock, FollowsAClockThatIsSetAnew) {
  PoseClock clock;
  for (int i = 0; i < 100; ++i) clock.local_s(i * 0.01, 100 + i * 0.01);
  // Their clock goes back by 50 s: the old offset is forgotten within two windows.
  double local_s = 0, arrived_s = 0;
  for (int i = 0; i < 500; ++i) {
    arrived_s = 101 + i * 0.01;
    local_s = clock.local_s(-49 + i * 0.01, arrived_s);
    EXPECT_LE(local_s, arrived_s + 1e-9);
  }
  EXPECT_NEAR(local_s, arrived_s, 1e-9);
}

}  // namespace
}  // namespace telesplat::tracking
