// Times at which the packer does work that can wait.
#include "services/packer/packer_service.h"

#include <gtest/gtest.h>

namespace telesplat::packer {
namespace {

wire::PlanRequest question(uint64_t viewer, uint64_t frame, int width) {
  wire::PlanRequest r{.frame = {frame}, .epoch = {1}, .viewer = {viewer}, .extra = true};
  r.camera.width = width;
  return r;
}

TEST(SpareTime, BeginsWhileNoViewIsUnderWay) {
  SpareTime spare;
  EXPECT_TRUE(spare.begins(10, false));
  EXPECT_FALSE(spare.begins(10.1, true));
  EXPECT_TRUE(spare.begins(10.15, false)) << "the view is complete";
  EXPECT_FALSE(spare.begins(10.15 + 0.9 * SpareTime::kLongestHurry_s, true));
  EXPECT_TRUE(spare.begins(10.15 + 1.1 * SpareTime::kLongestHurry_s, true)) << "some view is always under way";
  EXPECT_FALSE(spare.begins(10.16 + 1.1 * SpareTime::kLongestHurry_s, true)) << "one piece at a time";
}

TEST(SpareTime, TheQuestionIsAboutItsViewersNewestView) {
  SpareTime spare;
  EXPECT_EQ(spare.question(1), nullptr);
  spare.keep(question(5, 1, 100));
  EXPECT_EQ(spare.question(1)->frame.value, 1u);
  spare.keep(question(6, 2, 200));
  EXPECT_EQ(spare.question(1)->frame.value, 2u) << "the master does not wait for the other any more";
  wire::PlanRequest view = question(6, 3, 300);
  view.extra = false, view.still = true;
  view.viewer = {5};
  spare.follow(view);
  EXPECT_EQ(spare.question(1)->camera.width, 200);
  view.viewer = {6};
  spare.follow(view);
  EXPECT_EQ(spare.question(1)->camera.width, 300);
  EXPECT_TRUE(spare.question(1)->still);
  EXPECT_EQ(spare.question(1)->frame.value, 2u) << "the master waits for this one";
  spare.worked(0, 0, true);
  EXPECT_EQ(spare.question(1), nullptr);
}

TEST(SpareTime, QuestionsTakeAQuarterOfTheTimeOfAHeadThatMoves) {
  SpareTime spare;
  spare.keep(question(5, 1, 100));
  ASSERT_TRUE(spare.question(1));
  spare.worked(1, 1.02, true);
  spare.keep(question(5, 2, 100));
  EXPECT_FALSE(spare.question(1.07));
  ASSERT_TRUE(spare.question(1.081));
  EXPECT_EQ(spare.question(1.081)->frame.value, 2u);
  spare.worked(1.2, 1.21, false);
  EXPECT_FALSE(spare.question(1.23));
  ASSERT_TRUE(spare.question(1.241));
  EXPECT_EQ(spare.question(1.241)->frame.value, 2u) << "it goes on";
  wire::PlanRequest view = question(5, 99, 100);
  view.still = true;
  spare.worked(1.3, 1.5, false);
  spare.follow(view);
  EXPECT_TRUE(spare.question(1.5)) << "no view is kept waiting";
  for (double now_s = 1.5; now_s < 6.45; now_s += 0.1) spare.worked(now_s, now_s + 0.1, false);
  view.still = false;
  spare.follow(view);
  EXPECT_FALSE(spare.question(6.6));
  EXPECT_TRUE(spare.question(6.95)) << "what was done for a head that rested is not owed by one that moves";
}

}  // namespace
}  // namespace telesplat::packer
