// A head whose poses another program sends.
#include "client/viewer/input/tracked_head.h"

#include <gtest/gtest.h>

namespace telesplat::viewer {
namespace {

wire::HeadPose at_x(double t_s, double x) { return {t_s, {{x, 0, 0}, {1, 0, 0, 0}}}; }

TEST(TrackedHead, StandsNowhereBeforeItsFirstPose) {
  TrackedHead head(tracking::Prediction::kNone);
  EXPECT_FALSE(head.at(1, 0).has_value());
  EXPECT_FALSE(head.take_news(1).has_value());
}

TEST(TrackedHead, FollowsPosesInTheirOwnClock) {
  TrackedHead head(tracking::Prediction::kVelocity);
  // It moves at 1 m/s; its clock is 1000 s ahead; every second message is 4 ms late.
  for (int i = 0; i < 100; ++i) head.told(at_x(1000 + i * 0.01, i * 0.01), i * 0.01 + (i % 2 ? 0.004 : 0.0));
  const auto pose = head.at(0.995, 0.02);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->position_room.x, 1.015, 0.002);
  EXPECT_EQ(head.figures().poses, 100u);
  EXPECT_EQ(head.figures().late, 0u);
}

// The sender's clock is 100 s ahead; the fastest message took 5 ms.
TEST(TrackedHead, KnowsWhenThePoseItShowsWasTaken) {
  for (const auto method : {tracking::Prediction::kNone, tracking::Prediction::kKalman}) {
    TrackedHead head(method);
    for (int i = 0; i < 100; ++i) head.told(at_x(100 + i * 0.01, i * 0.01), i * 0.01 + 0.005);
    ASSERT_TRUE(head.at(1.0, 0.02));
    EXPECT_NEAR(head.moment().taken_s, 0.995, 1e-9) << "the newest pose, as it came";
    EXPECT_NEAR(head.moment().ahead_s, method == tracking::Prediction::kNone ? 0 : 0.025, 1e-9);
    ASSERT_TRUE(head.at(1.5, 0.02));
    EXPECT_NEAR(head.moment().taken_s, 0.995, 1e-9);
    EXPECT_NEAR(head.moment().ahead_s, method == tracking::Prediction::kNone ? 0 : TrackedHead::kMostAhead_s, 1e-9);
  }
}

TEST(TrackedHead, ASilentTrackerLeavesTheHeadWhereItWas) {
  TrackedHead head(tracking::Prediction::kVelocity);
  for (int i = 0; i < 50; ++i) head.told(at_x(i * 0.01, i * 0.01), i * 0.01);
  EXPECT_EQ(head.take_news(0.5), "poses move the head");
  const double x = head.at(0.7, 0.02)->position_room.x;
  EXPECT_NEAR(x, 0.49 + TrackedHead::kMostAhead_s, 1e-9);
  EXPECT_EQ(head.at(100, 0.02)->position_room.x, x);
  EXPECT_NE(head.take_news(1.1).value_or("").find("no poses for 0.5 s"), std::string::npos);
  EXPECT_FALSE(head.take_news(1.2).has_value()) << "it is told once";
  head.told(at_x(2, 0), 2);
  EXPECT_EQ(head.take_news(2), "poses come again");
}

TEST(TrackedHead, PosesThatComeAfterNewerOnesArePassedOver) {
  TrackedHead head(tracking::Prediction::kNone);
  head.told(at_x(1.00, 0), 0.00);
  head.told(at_x(1.02, 2), 0.02);
  head.told(at_x(1.01, 1), 0.021);
  EXPECT_EQ(head.at(0.03, 0)->position_room.x, 2);
  EXPECT_EQ(head.figures().late, 1u);
}

TEST(TrackedHead, ATrackerThatCountsTimeAnewIsFollowedSoon) {
  TrackedHead head(tracking::Prediction::kNone);
  for (int i = 0; i < 100; ++i) head.told(at_x(500 + i * 0.01, 0), i * 0.01);
  double arrived_s = 1;
  for (int i = 0; i < 40; ++i, arrived_s += 0.01) head.told(at_x(i * 0.01, 7), arrived_s);
  EXPECT_EQ(head.at(arrived_s, 0)->position_room.x, 7);
}

TEST(TrackedHead, WhatIsNoPoseIsToldButNotOften) {
  TrackedHead head(tracking::Prediction::kNone);
  std::vector<std::string> told;
  for (int i = 0; i < 1000; ++i) {
    head.refused();
    if (const auto news = head.take_news(i * 0.01)) told.push_back(*news);
  }
  EXPECT_EQ(told.size(), 2u);
  EXPECT_EQ(told.front(), "a message was no pose and did nothing");
  EXPECT_EQ(head.figures().refused, 1000u);
}

TEST(TrackedHead, ItsPredictionsAreMeasured) {
  TrackedHead head(tracking::Prediction::kVelocity);
  for (int i = 0; i < 200; ++i) {
    head.told(at_x(i * 0.01, i * 0.01), i * 0.01);
    head.at(i * 0.01, 0.05);
  }
  const auto f = head.figures().prediction;
  EXPECT_GT(f.count, 150u);
  EXPECT_NEAR(f.unpredicted_m, 0.05, 0.002);
  EXPECT_LT(f.error_m, 0.005);
}

}  // namespace
}  // namespace telesplat::viewer
