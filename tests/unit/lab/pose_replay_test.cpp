// Times at which poses of a recorded movement are sent.
#include <gtest/gtest.h>

#include "tools/lab/pose_replay/schedule.h"

namespace telesplat::lab {
namespace {

std::vector<geometry::Trajectory::Sample> samples(int n) {
  std::vector<geometry::Trajectory::Sample> out;
  for (int i = 0; i < n; ++i) out.push_back({10 + i * 0.01, {{double(i), 0, 0}, {1, 0, 0, 0}}});
  return out;
}

TEST(Schedule, SendsEachPoseAtItsTime) {
  Schedule schedule(samples(100), false, {});
  for (int i = 0; i < 100; ++i) {
    const auto due = schedule.next();
    ASSERT_TRUE(due);
    EXPECT_NEAR(due->send_s, i * 0.01, 1e-9);
    EXPECT_NEAR(due->t_s, i * 0.01, 1e-9);
    EXPECT_EQ(due->pose.position_room.x, i);
  }
  EXPECT_FALSE(schedule.next());
  EXPECT_NEAR(schedule.length_s(), 0.99, 1e-9);
}

TEST(Schedule, JitterMakesPosesLateAndKeepsTheirOrder) {
  Schedule schedule(samples(1000), false, {.jitter_s = 0.03});
  double before_s = -1, latest_s = 0;
  for (auto due = schedule.next(); due; due = schedule.next()) {
    EXPECT_GE(due->send_s, before_s);
    EXPECT_GE(due->send_s, due->t_s);
    EXPECT_LE(due->send_s, due->t_s + 0.03 + 1e-9);
    latest_s = std::max(latest_s, due->send_s - due->t_s);
    before_s = due->send_s;
  }
  EXPECT_GT(latest_s, 0.025);
}

TEST(Schedule, LosesTheShareThatItIsTold) {
  Schedule schedule(samples(10'000), false, {.loss = 0.3});
  int sent = 0;
  while (schedule.next()) ++sent;
  EXPECT_NEAR(sent, 7000, 200);
  EXPECT_EQ(schedule.lost() + uint64_t(sent), 10'000u);
}

TEST(Schedule, TheSameSeedIsTheSameRun) {
  const Disturbance disturbance{.jitter_s = 0.02, .loss = 0.2, .seed = 9};
  Schedule a(samples(500), false, disturbance), b(samples(500), false, disturbance);
  for (auto due = a.next(); due; due = a.next()) {
    const auto other = b.next();
    ASSERT_TRUE(other);
    EXPECT_EQ(due->send_s, other->send_s);
    EXPECT_EQ(due->pose.position_room.x, other->pose.position_room.x);
  }
}

TEST(Schedule, ALoopGoesOnInTime) {
  Schedule schedule(samples(10), true, {});
  for (int i = 0; i < 35; ++i) {
    const auto due = schedule.next();
    ASSERT_TRUE(due);
    EXPECT_NEAR(due->t_s, i * 0.01, 1e-9);
    EXPECT_EQ(due->pose.position_room.x, i % 10);
  }
  Schedule nothing(samples(10), true, {.loss = 1});
  EXPECT_FALSE(nothing.next()) << "who loses everything has an end";
}

}  // namespace
}  // namespace telesplat::lab
