// What the end of a session's process means for the session.
#include <gtest/gtest.h>

#include "tools/telesplat/run/pipeline.h"

namespace telesplat::launcher {
namespace {

constexpr int kRefused = 2, kCrashed = 128 + 11, kMany = 5;

TEST(EndedProcess, ServersThatDieAreStartedAgainSomeTimes) {
  for (const char* role : {"data", "packer", "sampler", "wan-relay"}) {
    EXPECT_EQ(consequence_of({role, kCrashed, 0, false}), Consequence::kRestart) << role;
    EXPECT_EQ(consequence_of({role, 1, kMany - 1, false}), Consequence::kRestart) << role;
    EXPECT_EQ(consequence_of({role, kCrashed, kMany, false}), Consequence::kFail) << role;
    EXPECT_EQ(consequence_of({role, kRefused, 0, false}), Consequence::kRefuse) << role;
    EXPECT_EQ(consequence_of({role, 0, 0, false}), Consequence::kNone) << role;
  }
}

TEST(EndedProcess, MasterAndViewersAreNot) {
  EXPECT_EQ(consequence_of({"master", 0, 0, false}), Consequence::kFinish);
  EXPECT_EQ(consequence_of({"master", kCrashed, 0, true}), Consequence::kFail);
  EXPECT_EQ(consequence_of({"viewer", 0, 0, true}), Consequence::kNone);
  EXPECT_EQ(consequence_of({"viewer", kCrashed, 0, true}), Consequence::kFail);
  EXPECT_EQ(consequence_of({"viewer", kRefused, 0, true}), Consequence::kRefuse);
}

// Its window stays, whatever the data set does to its server; other servers are as before.
TEST(EndedProcess, ADataSetThatWasChosenAtAWindowDoesNotEndTheSession) {
  EXPECT_EQ(consequence_of({"data", kRefused, 0, true}), Consequence::kGiveUp);
  EXPECT_EQ(consequence_of({"data", kCrashed, 0, true}), Consequence::kRestart);
  EXPECT_EQ(consequence_of({"data", kCrashed, kMany, true}), Consequence::kGiveUp);
  EXPECT_EQ(consequence_of({"sampler", kCrashed, kMany, true}), Consequence::kFail);
}

}  // namespace
}  // namespace telesplat::launcher
