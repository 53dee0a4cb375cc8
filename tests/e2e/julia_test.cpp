// Julia sets: whole runs of scenes that no file holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), {"--size", "320x200", "--sampling-size", "auto", "--record-points", "64"});
  return more;
}

TEST(Julia, WhatIsDisplayedIsWhatRaysSee) {
  auto flags = with(kComesToRest);
  flags.insert(flags.end(), {"--preset", "wings", "--verify", "60", "--samplers", "2"});
  PipelineRun run(flags, "julia");
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["kind"], "julia");
  EXPECT_EQ(s["scene"], "julia (wings)");
  EXPECT_TRUE(s["primitives"].is_null()) << "it has none";
  EXPECT_GT(s["updates"], 2);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_GE(s["quality"]["views"], 2);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], 20);
  // The head stands still: by now every pixel was sampled at the display's resolution.
  EXPECT_GT(s["quality"]["last_view"]["psnr_db"], 23);
  EXPECT_LT(s["quality"]["last_view"]["hole_fraction"], 0.02);
  EXPECT_NE(run.program().out().find("julia (wings): c = ("), std::string::npos) << run.program().out();

  // Views arrive coarse first, in rows, and every sampler takes part.
  const auto steps = run.column("tiles.csv", "step");
  EXPECT_GT(std::count(steps.begin(), steps.end(), 4), 0);
  EXPECT_GT(std::count(steps.begin(), steps.end(), 1), 0);
  EXPECT_EQ(steps.size(),
            size_t(std::count(steps.begin(), steps.end(), 4) + std::count(steps.begin(), steps.end(), 1)));

  Program inspect("telesplat", {"inspect", run.out()}, run.folder() / "inspect");
  EXPECT_EQ(inspect.wait(), 0) << inspect.err();
  for (const char* part : {"julia (wings)", "slice.turn-z", "colour.scale", "summary.json"})
    EXPECT_NE(inspect.out().find(part), std::string::npos) << part;

  Program compare("telesplat",
                  {"compare", run.out(), "--kernels", "disc", "--renderers", "cpu", "--poses", "2", "--repeat", "1"},
                  run.folder() / "compare");
  EXPECT_EQ(compare.wait(90), 0) << compare.err();
  EXPECT_TRUE(fs::exists(run.out() + "/compare/contact-sheet.png"));
}

TEST(Julia, EveryFrameOfAnAnimationIsOfOneEpochAndCanBeMadeAgain) {
  PipelineRun run(with({"--animate", "c.y=-0.5:-0.3:2s;slice.offset=0:0.2:3s", "--duration", "0", "--verify", "10",
                        "--trajectory", "still"}),
                  "julia");
  ASSERT_TRUE(wait_until([&] {
    const auto set = run.column("epochs.csv", "c.y"), seen = run.column("frames.csv", "epoch");
    const auto [least, most] = std::minmax_element(set.begin(), set.end());
    return set.size() > 5 && *most - *least > 0.1 && std::set<double>(seen.begin(), seen.end()).size() > 4;
  })) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto epochs = run.column("epochs.csv", "epoch"), values = run.column("epochs.csv", "c.y"),
             others = run.column("epochs.csv", "c.x"), shown = run.column("frames.csv", "epoch"),
             drawn = run.column("frames.csv", "points_drawn");
  ASSERT_EQ(values.size(), epochs.size());
  EXPECT_TRUE(std::is_sorted(epochs.begin(), epochs.end()));
  EXPECT_EQ(std::set<double>(epochs.begin(), epochs.end()).size(), epochs.size());
  for (const double v : values) {
    EXPECT_GE(v, -0.5 - 1e-9);
    EXPECT_LE(v, -0.3 + 1e-9);
  }
  EXPECT_EQ(std::set<double>(others.begin(), others.end()).size(), 1u) << "c.x is not animated";

  // Epochs are displayed in their order, each known, and never nothing once there was something.
  ASSERT_EQ(shown.size(), drawn.size());
  double newest = 0;
  bool something = false;
  for (size_t i = 0; i < shown.size(); ++i) {
    if (drawn[i] == 0) {
      EXPECT_FALSE(something) << "frame " << i << " shows nothing";
      continue;
    }
    something = true;
    EXPECT_GE(shown[i], newest) << "frame " << i;
    newest = shown[i];
    EXPECT_NE(std::find(epochs.begin(), epochs.end(), shown[i]), epochs.end()) << shown[i];
  }
  // Compared with the set of its own epoch each frame is right (31 dB; 26 where programs are slow); compared with the
  // first epoch's all are at 21 dB.
  const auto s = run.summary();
  EXPECT_GE(s["quality"]["views"], 2);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], kSlow ? 24 : 27);
}

TEST(Julia, ParametersAreSetAndAnimatedWhileItRuns) {
  PipelineRun run(with({"--duration", "0", "--trajectory", "still"}), "julia");
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  EXPECT_EQ(ctl(run, {"set", "c.y=0.3", "palette=ice"}), 0);
  EXPECT_NE(ctl(run, {"set", "c.y=7"}), 0);
  EXPECT_NE(ctl(run, {"set", "c.q=1"}), 0);
  EXPECT_EQ(ctl(run, {"set", "c.y"}), 2);
  EXPECT_EQ(ctl(run, {"set"}), 2);
  EXPECT_EQ(ctl(run, {"animate", "c.y"}), 2);
  EXPECT_EQ(ctl(run, {"animate", "c.x=0.3:0.4:1s"}), 0);
  EXPECT_TRUE(wait_until([&] { return run.column("epochs.csv", "epoch").size() > 4; }))
      << run.column("epochs.csv", "epoch").size();
  EXPECT_EQ(ctl(run, {"animate", "off"}), 0);
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  const auto values = run.column("epochs.csv", "c.y"), palettes = run.column("epochs.csv", "palette");
  ASSERT_FALSE(values.empty());
  EXPECT_EQ(values.back(), 0.3);
  EXPECT_EQ(palettes.back(), 7);
  EXPECT_EQ(std::count(values.begin(), values.end(), 7), 0);
  EXPECT_TRUE(run.all_gone());
}

}  // namespace
}  // namespace telesplat::test
