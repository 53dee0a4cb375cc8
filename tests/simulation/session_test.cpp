// Whole sessions, simulated: seeds that found defects, the same messages on every instruction set, and some hundred
// sessions more.
#include <gtest/gtest.h>

#include "client/viewer/points/received_points.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "tests/simulation/digests.h"
#include "tests/support/simd_targets.h"
#include "tools/lab/simulation/run.h"

namespace telesplat::simulation {
namespace {

const auto* const plain_functions = add_plain_functions();

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
  Scenario s{.seed = 780, .duration_s = 14.54, .show = Show::kTerrain, .samplers = 3, .display_hz = 8};
  s.coupling = {viewer::CouplingMode::kSync, 1};
  s.tile_s = 0.013944531;
  s.one_machine = false;
  s.keys = true;
  s.links.latency_s = 0.00019407448;
  s.to_viewers = {.latency_s = 0.028236543, .jitter_s = 0.0001823445, .bytes_s = 2744789};
  s.settings.obsolete_after_s = 4.2616848;
  s.settings.errors.depth = 0.40622853, s.settings.errors.normal = 4, s.settings.errors.colour = 8;
  s.events = {{.at_s = 2.0865,
               .fault = Fault::kOrder,
               .a = {},
               .b = {Role::kViewer, 0},
               .order = "coupling|coupling=loose|buffers=2"},
              {.at_s = 5.459, .fault = Fault::kImpostor, .a = {Role::kData, 0}, .b = {Role::kViewer, 0}, .amount = 0},
              {.at_s = 6.7536, .fault = Fault::kOrder, .a = {}, .b = {Role::kViewer, 0}, .order = "epoch"}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, APackerThatHearsNothingKeepsWhatIsOnDisplay) {
  Scenario s{.seed = 784, .duration_s = 14.5, .show = Show::kTerrain, .samplers = 1, .viewers = 2, .display_hz = 8};
  s.tile_size = 64;
  s.tile_s = 0.0061638363;
  s.links = s.to_viewers = {.latency_s = 0.00014596261, .jitter_s = 0.0014350043};
  s.settings.obsolete_after_s = 3.7272724;
  s.events = {{.at_s = 1.3372, .fault = Fault::kIsolate, .a = {Role::kPacker, 0}, .b = {}, .amount = 4.1}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, ARequestThatIsRepeatedShowsNoOlderSlices) {
  Scenario s{.seed = 1018, .duration_s = 12.2, .show = Show::kBall, .samplers = 1, .display_hz = 3};
  s.tile_size = 64;
  s.tile_s = 0.0099240534;
  s.one_machine = false;
  s.links = {.latency_s = 0.00033108779, .jitter_s = 9.77333505885183e-05};
  s.to_viewers = {.latency_s = 0.073561398, .bytes_s = 4113289};
  s.settings.steering = false;
  s.settings.obsolete_after_s = 4.0314150;
  s.settings.view_cell_m = 0;
  s.events = {{.at_s = 1.867, .fault = Fault::kStranger, .a = {Role::kMaster, 0}, .b = {}, .amount = 31}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

TEST(Sessions, PartsOfAnotherVolumeAreTakenOnceThoseBeforeHaveLeft) {
  Scenario s{.seed = 19, .show = Show::kBall, .data_servers = 2};
  s.events = {{.at_s = 2,
               .fault = Fault::kShow,
               .a = {Role::kData, 0},
               .b = {},
               .amount = 0.6,
               .order = {},
               .show = Show::kSeries}};
  EXPECT_EQ(text_of(outcome_of(s).failure), "holds");
}

// ---- the base -------------------------------------------------------------------------------------------------------

// Notes where the base that a viewer draws comes and goes.
class BaseWatch final : public Observer {
 public:
  void on_frame(Part, SimulatedViewer& viewer, const viewer::DrawnFrame&, double) override {
    splat::DrawList list;
    dynamic_cast<viewer::ReceivedPoints&>(*viewer.received()).cache().select_part(viewer.camera(), {}, list);
    if (shown.empty() || shown.back() != splat::has_base(list)) shown.push_back(splat::has_base(list));
  }
  std::vector<bool> shown;
};

TEST(Sessions, AViewerDropsTheBaseWithItsScene) {
  Scenario s{.seed = 1, .duration_s = 18, .show = Show::kSpheres};
  s.to_viewers = {.latency_s = 0.1};
  const auto shows = [](double at_s, Show show) {
    return Event{.at_s = at_s, .fault = Fault::kShow, .a = {Role::kData, 0}, .b = {}, .amount = 0.5, .show = show};
  };
  s.events = {shows(3, Show::kTerrain), shows(6, Show::kJulia), shows(9, Show::kSpheres)};
  log::initialise("simulation", "off");
  BaseWatch watch;
  EXPECT_EQ(text_of(run_scenario(s, {&watch}).failure), "holds");
  if (!watch.shown.front()) watch.shown.erase(watch.shown.begin());  // frames before the base came
  EXPECT_EQ(watch.shown, (std::vector{true, false, true, false, true})) << "spheres, terrain, and a Julia set's none";
}

// ---- all of it ------------------------------------------------------------------------------------------------------

// Links of 60 kB a second: the root of the chunks comes before the others, and stands in for them in another colour.
TEST(Sessions, HoldWhereCoarseChunksStandInForOthers) {
  Scenario s{.seed = 52, .show = Show::kTerrain, .samplers = 1};
  s.links = {.latency_s = 0.001, .bytes_s = 60000};
  struct Counter final : Observer {
    size_t coarse = 0, fine = 0;
    void on_passed(const Passed& passed) override {
      if (passed.type != wire::DepthTile::kName || passed.what != Passed::What::kDelivered) return;
      const auto tile = wire::decode<wire::DepthTile>(passed.body);
      if (tile) ++(tile->coarse ? coarse : fine);
    }
  } counter;
  log::initialise("simulation", "off");
  EXPECT_EQ(text_of(run_scenario(s, {&counter}).failure), "holds");
  EXPECT_GT(counter.coarse, 0u);
  EXPECT_GT(counter.fine, counter.coarse);
}

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

TEST(Sessions, HoldAndSendTheSameToTheByte) {
  const auto golden = golden_digests();
  std::vector<Scenario> scenarios;
  for (uint64_t seed = 1; seed <= 300; ++seed) scenarios.push_back(draw_scenario(seed));
  run_children(scenarios, usable_processors(), [&](const Scenario& s, const Ran& ran) {
    EXPECT_FALSE(ran.outcome.failure) << "telesplat-lab simulate --seed " << s.seed
                                      << " --trace: " << text_of(ran.outcome.failure);
    expect_digest(golden, "seed-" + std::to_string(s.seed), ran.outcome.digest);
    return true;
  });
}

}  // namespace
}  // namespace telesplat::simulation
