// The consequence of a process' end for its session.
#include <gtest/gtest.h>

#include <string_view>

#include "tools/telesplat/run/pipeline.h"

namespace telesplat::launcher {
namespace {

constexpr int kRefused = 2, kCrashed = 128 + 11, kMany = 5;

TEST(EndedProcess, ServersThatDieAreStartedAgainSomeTimes) {
  for (const char* role : {"master", "data", "packer", "sampler", "wan-relay"}) {
    EXPECT_EQ(consequence_of({role, kCrashed, 0, false}), Consequence::kRestart) << role;
    EXPECT_EQ(consequence_of({role, 1, kMany - 1, false}), Consequence::kRestart) << role;
    EXPECT_EQ(consequence_of({role, kCrashed, kMany, false}), Consequence::kFail) << role;
    EXPECT_EQ(consequence_of({role, kRefused, 0, false}), Consequence::kRefuse) << role;
    EXPECT_EQ(consequence_of({role, 0, 0, false}),
              std::string_view(role) == "master" ? Consequence::kFinish : Consequence::kNone)
        << role;
  }
}

TEST(EndedProcess, ViewersAreNot) {
  EXPECT_EQ(consequence_of({"viewer", 0, 0, true}), Consequence::kNone);
  EXPECT_EQ(consequence_of({"viewer", kCrashed, 0, true}), Consequence::kFail);
  EXPECT_EQ(consequence_of({"viewer", kRefused, 0, true}), Consequence::kRefuse);
}

TEST(EndedProcess, AViewerThatDiesDoesNotEndTheSessionOfOthers) {
  for (const int code : {1, 128 + 6, 128 + 9, kCrashed}) {
    EXPECT_EQ(consequence_of({.role = "viewer", .code = code, .others = true}), Consequence::kGiveUp) << code;
    EXPECT_EQ(consequence_of({.role = "viewer", .code = code, .others = false}), Consequence::kFail) << code;
  }
  EXPECT_EQ(consequence_of({.role = "viewer", .code = kRefused, .others = true}), Consequence::kRefuse);
}

// The session's window stays, even if the data set ends its server; other servers behave as before.
TEST(EndedProcess, ADataSetThatWasChosenAtAWindowDoesNotEndTheSession) {
  EXPECT_EQ(consequence_of({"data", kRefused, 0, true}), Consequence::kGiveUp);
  EXPECT_EQ(consequence_of({"data", kCrashed, 0, true}), Consequence::kRestart);
  EXPECT_EQ(consequence_of({"data", kCrashed, kMany, true}), Consequence::kGiveUp);
  EXPECT_EQ(consequence_of({"sampler", kCrashed, kMany, true}), Consequence::kFail);
}

TEST(EndedProcess, DeathsLongAgoDoNotCount) {
  Restarts restarts;
  double now_s = 1000;
  for (int i = 0; i < 100; ++i, now_s += 20) {  // an hour's, one every 20 s
    EXPECT_EQ(consequence_of({"sampler", kCrashed, restarts.lately(now_s), false}), Consequence::kRestart) << i;
    EXPECT_LE(restarts.died(now_s), now_s + 1) << i;
  }
  EXPECT_EQ(restarts.all(), 100);
  EXPECT_EQ(restarts.lately(now_s + Restarts::kWithin_s), 0);
}

TEST(EndedProcess, OneThatDiesAgainAndAgainWaitsLongerAndLonger) {
  Restarts restarts;
  double now_s = 1000, before_s = 0;
  for (int i = 0; i < Restarts::kMost; ++i) {
    ASSERT_EQ(consequence_of({"packer", kCrashed, restarts.lately(now_s), false}), Consequence::kRestart) << i;
    const double again_s = restarts.died(now_s);
    if (i == 0) {
      EXPECT_EQ(again_s, now_s) << "the first at once";
    } else if (i > 1) {
      EXPECT_EQ(again_s - now_s, 2 * before_s);
    }
    before_s = again_s - now_s;
    now_s = again_s + 0.1;
  }
  EXPECT_EQ(consequence_of({"packer", kCrashed, restarts.lately(now_s), false}), Consequence::kFail);
}

}  // namespace
}  // namespace telesplat::launcher
