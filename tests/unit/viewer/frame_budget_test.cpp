// The frame-time controller on simulated machines, and detail by speed.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "client/viewer/coupling/frame_budget.h"
#include "common/geometry/trajectory.h"
#include "common/splat/select/level_choice.h"

namespace telesplat::viewer {
namespace {

constexpr double kBudget_ms = 14;

// Share of all points drawn at this detail. Mosaics' ratios are spread evenly over an octave, or all are 1; each mosaic
// thins out as in between_levels.
double points_drawn(double detail, int ratios) {
  const auto passed = [](double wanted) {
    const double t = (wanted - splat::kTransitionBegin) / (splat::kTransitionEnd - splat::kTransitionBegin);
    return std::pow((1 + std::clamp(t, 0.0, 1.0)) / 2, 2);
  };
  double sum = 0;
  for (int i = 0; i < ratios; ++i) {
    const double wanted = detail * std::exp2(-static_cast<double>(i) / ratios);
    sum += passed(wanted) * passed(2 * wanted);
  }
  return sum / ratios;
}

// Time of a frame in budgets: `load` at full detail; the share `fixed` of it does not depend on points.
double levels_time(double detail, double load, double fixed, int ratios) {
  return load * (fixed + (1 - fixed) * points_drawn(detail, ratios) / points_drawn(1, ratios));
}

struct Course {
  std::vector<double> detail, load;
  double late_share_above(double limit, size_t last) const {
    double n = 0;
    for (size_t i = load.size() - last; i < load.size(); ++i) n += load[i] > limit;
    return n / double(last);
  }
  // Largest over least detail among the last frames.
  double late_swing(size_t last) const {
    const auto [least, most] = std::minmax_element(detail.end() - std::ptrdiff_t(last), detail.end());
    return *most / *least;
  }
};

Course simulate(FrameBudget& budget, int frames, const std::function<double(double detail, int frame)>& machine) {
  Course run;
  for (int i = 0; i < frames; ++i) {
    const double detail = budget.detail(), load = machine(detail, i);
    run.detail.push_back(detail);
    run.load.push_back(load);
    budget.frame_done(0, load * kBudget_ms, 1e6, detail);
    const double step = std::abs(std::log(budget.detail() / detail));
    EXPECT_LE(step, 0.0601) << "frame " << i;
    EXPECT_GE(budget.detail(), kLeastDetail);
    EXPECT_LE(budget.detail(), 1.0);
  }
  return run;
}

TEST(FrameBudget, FastMachinesShowEverything) {
  FrameBudget budget(kBudget_ms);
  const Course run = simulate(budget, 300, [](double d, int) { return levels_time(d, 0.7, 0.3, 8); });
  EXPECT_EQ(run.late_swing(300), 1.0);
  EXPECT_EQ(budget.detail(), 1.0);
}

TEST(FrameBudget, SlowMachinesSettleWithinTheBudget) {
  for (const double load : {1.2, 1.6, 2.5, 4.0})
    for (const double fixed : {0.05, 0.15})
      for (const int ratios : {1, 3, 16}) {
        FrameBudget budget(kBudget_ms);
        const Course run = simulate(budget, 400, [&](double d, int) { return levels_time(d, load, fixed, ratios); });
        SCOPED_TRACE(testing::Message() << "load " << load << " fixed " << fixed << " ratios " << ratios);
        EXPECT_LE(run.late_share_above(1.005, 280), 0.0) << "within two seconds";
        EXPECT_LT(run.late_swing(200), 1.02) << "and does not oscillate";
        EXPECT_GT(run.load.back(), 0.6) << "nor gives away more than it must";
        EXPECT_LT(budget.detail(), 1.0);
      }
}

TEST(FrameBudget, NoiseIsNotSeen) {
  for (const double load : {0.6, 2.0}) {
    FrameBudget budget(kBudget_ms);
    std::mt19937 rng(7);
    std::lognormal_distribution<double> noise(0, 0.08);
    const Course run = simulate(budget, 900, [&](double d, int i) {
      return levels_time(d, load, 0.2, 8) * noise(rng) * (i % 60 == 59 ? 8 : 1);  // now and then one slow frame
    });
    EXPECT_LT(run.late_swing(600), load < 1 ? 1.0001 : 1.06) << load;
    EXPECT_LT(run.late_share_above(1.15, 600), 0.03 + 1.0 / 60) << load;
  }
}

// Simulates frames that take `load` budgets, and load / saved at half size. Returns on() of each frame.
std::vector<bool> halves(HalfSize& size, int frames, const std::function<double(int frame)>& load, double saved,
                         bool least = true) {
  std::vector<bool> out;
  for (int i = 0; i < frames; ++i) {
    out.push_back(size.on());
    size.frame_done(load(i) * kBudget_ms / (size.on() ? saved : 1), least);
  }
  return out;
}
size_t changes(const std::vector<bool>& on) {
  size_t out = 0;
  for (size_t i = 1; i < on.size(); ++i) out += on[i] != on[i - 1];
  return out;
}

TEST(HalfSize, BeginsWithinASecondWhereFramesTakeTooLongAndStays) {
  for (const double load : {1.3, 2.0, 6.0})
    for (const double saved : {1.5, 2.5, 4.0}) {
      HalfSize size(kBudget_ms);
      const auto on = halves(
          size, 600, [&](int) { return load; }, saved);
      EXPECT_EQ(changes(on), 1u) << load << " " << saved;
      EXPECT_TRUE(on[60]) << load << " " << saved;
    }
}

TEST(HalfSize, EndsWhenFramesOfFullSizeHaveTime) {
  for (const double saved : {1.5, 2.5, 4.0}) {
    HalfSize size(kBudget_ms);
    const auto on = halves(
        size, 900, [](int i) { return i < 300 ? 1.6 : 0.5; }, saved);
    EXPECT_EQ(changes(on), 2u) << saved;
    EXPECT_TRUE(on[299]);
    EXPECT_FALSE(on[400]) << saved;
  }
}

TEST(HalfSize, IsNothingForFramesInTimeNorForSingleOnesNorWhileDetailFalls) {
  std::mt19937 rng(7);
  std::lognormal_distribution<double> noise(0, 0.1);
  for (const double load : {0.5, 0.95}) {
    HalfSize size(kBudget_ms);
    EXPECT_EQ(changes(halves(
                  size, 2000, [&](int i) { return load * noise(rng) * (i % 60 == 59 ? 8 : 1); }, 2)),
              0u)
        << load;
  }
  HalfSize size(kBudget_ms), without(0);
  EXPECT_EQ(changes(halves(
                size, 300, [](int) { return 2.0; }, 2, false)),
            0u)
      << "less detail may be enough";
  EXPECT_EQ(changes(halves(
                without, 300, [](int) { return 2.0; }, 2)),
            0u)
      << "frames are not paced";
  size.frame_done(std::numeric_limits<double>::quiet_NaN(), true);
  size.frame_done(-1, true);
  EXPECT_FALSE(size.on());
}

TEST(FrameBudget, FollowsTheLoad) {
  FrameBudget budget(kBudget_ms);
  const auto machine = [](double d, int i) { return levels_time(d, i >= 100 && i < 400 ? 2.2 : 0.6, 0.2, 8); };
  const Course run = simulate(budget, 600, machine);
  EXPECT_EQ(run.detail[99], 1.0);
  for (int i = 170; i < 400; ++i) EXPECT_LE(run.load[i], 1.02) << i << ": 1.2 s after the load rose";
  EXPECT_LT(run.detail[399], 0.9);
  EXPECT_GT(run.detail[460], 0.995) << "all back a second after it fell";
  EXPECT_EQ(budget.detail(), 1.0);
}

TEST(FrameBudget, EndsAtTheLeastDetail) {
  FrameBudget budget(kBudget_ms);
  simulate(budget, 200, [](double, int) { return 50.0; });
  EXPECT_EQ(budget.detail(), kLeastDetail);
}

TEST(FrameBudget, IsSwitchedOffByNoBudgetAndIgnoresNonsense) {
  FrameBudget off(0);
  for (int i = 0; i < 50; ++i) off.frame_done(0, 1e6, 1e6, 1);
  EXPECT_EQ(off.detail(), 1.0);
  FrameBudget budget(kBudget_ms);
  for (int i = 0; i < 50; ++i) {
    budget.frame_done(0, std::nan(""), 1e6, 1);
    budget.frame_done(0, std::numeric_limits<double>::infinity(), 1e6, 1);
    budget.frame_done(0, -1, 1e6, 1);
    budget.frame_done(0, 1e6, 0, 1);
  }
  EXPECT_EQ(budget.detail(), 1.0);
}

TEST(FrameBudget, WhatDetailCannotChangeIsTakenFromTheBudgetButNotAllOfIt) {
  const auto settle = [](double select_ms, double draw_ms) {
    FrameBudget budget(kBudget_ms);
    double drawn_ms = 0;
    for (int i = 0; i < 400; ++i) {
      drawn_ms = draw_ms * points_drawn(budget.detail(), 8) / points_drawn(1, 8);
      budget.frame_done(select_ms, drawn_ms, 1e6, budget.detail());
    }
    return std::pair{budget.detail(), drawn_ms};
  };
  EXPECT_EQ(settle(2, 0.5 * kBudget_ms).first, 1.0);
  const auto [detail, drawn_ms] = settle(0.3 * kBudget_ms, kBudget_ms);
  EXPECT_LT(detail, 1.0);
  EXPECT_LE(drawn_ms, 0.705 * kBudget_ms);
  EXPECT_GT(drawn_ms, 0.5 * kBudget_ms);
  EXPECT_EQ(settle(1.5 * kBudget_ms, 0.3 * kBudget_ms).first, 1.0) << "too slow, but not for the points' sake";
}

TEST(FrameBudget, IsNotMisledByFramesDrawnWithLess) {
  FrameBudget budget(kBudget_ms);
  simulate(budget, 200, [](double d, int) { return levels_time(d, 2.0, 0.2, 8); });
  const double settled = budget.detail();
  EXPECT_LT(settled, 0.9);
  for (int i = 0; i < 200; ++i) budget.frame_done(0, 0.2 * kBudget_ms, 1e5, 0.5 * settled);
  EXPECT_EQ(budget.detail(), settled);
}

geometry::Camera turned(double angle_rad, double distance_m = 0) {
  geometry::Pose pose;
  pose.position_room = {distance_m, 0, 0};
  pose.orientation = glm::dquat(std::cos(angle_rad / 2), 0, std::sin(angle_rad / 2), 0);
  return geometry::make_camera(pose, 90, 1280, 800);
}

TEST(SpeedDetail, MovementIsMeasuredInPixels) {
  EXPECT_NEAR(screen_movement(turned(0).pose, turned(0.01).pose, 1, 640), 6.4, 1e-6);
  EXPECT_NEAR(screen_movement(turned(0).pose, turned(0, 0.01).pose, 0.5, 640), 12.8, 1e-6);
  EXPECT_EQ(screen_movement(turned(0.3, 1).pose, turned(0.3, 1).pose, 1, 640), 0.0);
}

TEST(SpeedDetail, FallsWithSpeedAndIsFullSoonAfterStandingStill) {
  double last = 1.1;
  for (const double speed_rad_s : {0.2, 1.5, 3.0, 20.0}) {
    SpeedDetail d;
    double t = 0, angle = 0;
    for (int i = 0; i < 60; ++i, t += 1 / 60.0, angle += speed_rad_s / 60) d.frame(t, turned(angle), 1);
    angle -= speed_rad_s / 60;  // stands still from here on
    EXPECT_LT(d.detail(), last);
    // Slow movements keep full detail.
    EXPECT_NEAR(d.detail(), std::clamp(SpeedDetail::kFreePixels / (640 * speed_rad_s / 60), kLeastDetail, 1.0), 0.01);
    last = d.detail();
    double previous = d.detail();
    for (int i = 0; i < 18; ++i, t += 1 / 60.0) {
      d.frame(t, turned(angle), 1);
      EXPECT_GE(d.detail(), previous - 1e-12);
      previous = d.detail();
    }
    EXPECT_GT(d.detail(), 0.97) << "0.3 s later";
  }
  SpeedDetail still;
  still.frame(1, turned(0), 1);
  still.frame(1, turned(2), 1);  // no time has passed
  EXPECT_EQ(still.detail(), 1.0);
}

}  // namespace
}  // namespace telesplat::viewer
