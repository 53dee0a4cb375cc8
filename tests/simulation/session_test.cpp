// Whole sessions, simulated: seeds that found defects, the same messages on every instruction set, and some hundred
// sessions more.
#include <gtest/gtest.h>

#include "common/core/machine.h"
#include "tests/support/simd_targets.h"
#include "tools/lab/simulation/run.h"

namespace telesplat::simulation {
namespace {

std::string text_of(const std::optional<Failure>& f) {
  return f ? f->check + " at " + std::to_string(f->at_s) + " s: " + f->text : "holds";
}

// Runs it in a process of its own, as simulate does: nothing of one session reaches another.
Outcome outcome_of(const Scenario& scenario) {
  Outcome out;
  run_children({scenario}, 1, [&](const Scenario&, const Ran& ran) {
    out = ran.outcome;
    return true;
  });
  return out;
}

// ---- defects that were found ----------------------------------------------------------------------------------------

TEST(Sessions, PointsOnDisplayAreNotObsoleteBetweenReports) {
  Scenario s{.seed = 16, .show = Show::kTerrain};
  s.settings.obsolete_after_s = 0.5;
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, ANewMasterLeasesNothingBeforeItKnowsTheScene) {
  Scenario s{.seed = 148, .show = Show::kBall};
  s.events = {{.at_s = 2, .fault = Fault::kKill, .a = {Role::kData, 0}, .b = {}, .amount = 2},
              {.at_s = 2.1, .fault = Fault::kKill, .a = {Role::kMaster, 0}, .b = {}, .amount = 0.3}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, AnUpdateThatWaitsForAnEarlierOneEndsWhereItWasComplete) {
  Scenario s = draw_scenario(780);
  s.events = {
      {.at_s = 2.0865, .fault = Fault::kCoupling, .a = {Role::kMaster, 0}, .b = {Role::kViewer, 0}, .amount = 2},
      {.at_s = 5.459, .fault = Fault::kImpostor, .a = {Role::kData, 0}, .b = {Role::kViewer, 0}, .amount = 0},
      {.at_s = 6.7536, .fault = Fault::kEpoch, .a = {Role::kMaster, 0}, .b = {Role::kViewer, 0}, .amount = 0}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, APackerThatHearsNothingKeepsWhatIsOnDisplay) {
  Scenario s = draw_scenario(784);
  s.events = {{.at_s = 1.3372, .fault = Fault::kIsolate, .a = {Role::kPacker, 0}, .b = {}, .amount = 4.1}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, ARequestThatIsRepeatedShowsNoOlderSlices) {
  Scenario s = draw_scenario(1018);
  s.events = {{.at_s = 1.867, .fault = Fault::kStranger, .a = {Role::kMaster, 0}, .b = {}, .amount = 31}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

// ---- all of it ------------------------------------------------------------------------------------------------------

TEST(Sessions, AreTheSameOnEveryInstructionSet) {
  for (const uint64_t seed : {5u, 34u}) {
    const Outcome first = outcome_of(draw_scenario(seed));
    for (const int64_t target : testing::simd_targets()) {
      if (target > HWY_SSE4) continue;  // every machine that we run on has it
      const testing::OnTarget on(target);
      EXPECT_EQ(outcome_of(draw_scenario(seed)).digest, first.digest) << "seed " << seed << ", target " << target;
    }
  }
}

TEST(Sessions, HoldWithFaultsOfAllKinds) {
  std::vector<Scenario> scenarios;
  for (uint64_t seed = 1; seed <= 300; ++seed) scenarios.push_back(draw_scenario(seed));
  run_children(scenarios, usable_processors(), [](const Scenario& s, const Ran& ran) {
    EXPECT_FALSE(ran.outcome.failure) << "telesplat-lab simulate --seed " << s.seed
                                      << " --trace: " << text_of(ran.outcome.failure);
    return true;
  });
}

}  // namespace
}  // namespace telesplat::simulation
