// Runs without their beginning: --skip.
#include "tools/telesplat/record/skip.h"

#include <gtest/gtest.h>

#include <fstream>

#include "services/master/record/run_record.h"
#include "tests/support/files/own_folder.h"
#include "tools/telesplat/run/run_report.h"

namespace telesplat::launcher {
namespace {

// Five frames a second apart and three updates: the first two frames and the first update are slow.
class Skip : public ::testing::Test {
 protected:
  Skip() {
    auto record = std::move(metrics::RunRecord::open(run)).value();
    const metrics::Process viewer{"viewer", "viewer-1", 5, {{"kind", "mesh"}}, {{"peak_rss_mb", 50}}};
    const double at_s = record->begin().monotonic_s + 10;
    std::vector<double> frames, updates;
    for (const auto& [i, ms] : {std::pair{0, 0}, {1, 90}, {2, 10}, {3, 12}, {4, 14}})
      frames.insert(frames.end(), {double(i), at_s + i, double(ms), ms + 5.0, double(i < 2), 0});
    EXPECT_TRUE(record->add_rows(
        viewer,
        {{5}, "frames", {"t_s", "begin_s", "inter_frame_ms", "motion_to_photon_ms", "missed", "still"}, frames}));
    for (const auto& [i, ms] : {std::pair{0, 500}, {2, 100}, {3, 200}})
      updates.insert(updates.end(), {at_s + i, double(ms), 1000.0, 200.0});
    EXPECT_TRUE(
        record->add_rows(viewer, {{5}, "updates", {"requested_s", "latency_ms", "points", "extra_points"}, updates}));
    EXPECT_TRUE(record->finish({viewer}, {{"frames_completed", 7}}));
  }
  const std::string run = tests::own_folder() + "run";
};

TEST_F(Skip, FiguresAreOfWhatBeganLater) {
  const auto s = summary_without_beginning(run, 1.5);
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ((*s)["skipped_s"], 1.5);
  EXPECT_EQ((*s)["frames"], 3);
  EXPECT_EQ((*s)["duration_s"], 2);
  EXPECT_EQ((*s)["fps"], 1.5);
  EXPECT_EQ((*s)["inter_frame_delay_ms"]["mean"], 12);
  EXPECT_EQ((*s)["inter_frame_jitter_ms"], 2);
  EXPECT_EQ((*s)["motion_to_photon_ms"]["max"], 19);
  EXPECT_EQ((*s)["updates"], 2);
  EXPECT_EQ((*s)["view_update_latency_ms"]["mean"], 150);
  EXPECT_EQ((*s)["frames_sampled"], 7) << "the master alone counts them";
  EXPECT_EQ((*s)["peak_rss_mb"]["viewer"][0], 50);
}

TEST_F(Skip, NothingIsLeftOutOfAllWithoutIt) {
  const auto s = summary_without_beginning(run, 0);
  ASSERT_TRUE(s);
  EXPECT_EQ((*s)["frames"], 5);
  EXPECT_EQ((*s)["view_update_latency_ms"]["max"], 500);
  EXPECT_FALSE(s->contains("skipped_s"));
}

TEST_F(Skip, ARunThatIsShorterIsRefused) {
  const auto s = summary_without_beginning(run, 4.5);
  ASSERT_FALSE(s);
  EXPECT_EQ(s.error().text, "--skip 4.5: " + run + " lasts 4.0 s");
  EXPECT_EQ(inspect_run(run, 4.5).error().text, s.error().text);
  EXPECT_FALSE(summary_without_beginning(run + "-none", 1));
}

TEST_F(Skip, VerifiedFramesAreLeftOutToo) {
  auto summary = nlohmann::ordered_json::parse(std::ifstream(run + "/summary.json"));
  summary["quality"] = {{"samples", 16}, {"psnr_db", {{"median", 1}}}};
  std::ofstream(run + "/summary.json") << summary;
  std::ofstream(run + "/quality.csv")
      << "frame,t_s,samples,psnr_db,ssim,flip,hole_fraction,object_pixels,flicker,popping\n"
         "0,0,16,10,0.5,0.5,0.5,100,,\n2,2,16,30,0.9,0.1,0.25,100,1,2\n3,3,16,40,0.8,0.2,0.75,100,,\n"
         "4,4,16,99,1,0,0,0,,\n";
  const auto s = summary_without_beginning(run, 1.5);
  ASSERT_TRUE(s) << s.error().text;
  EXPECT_EQ((*s)["quality"]["views"], 2);
  EXPECT_EQ((*s)["quality"]["psnr_db"]["median"], 35);
  EXPECT_EQ((*s)["quality"]["hole_fraction"]["mean"], 0.5);
  EXPECT_EQ((*s)["quality"]["flicker"]["mean"], 1);
  EXPECT_EQ((*s)["quality"]["samples"], 16);
}

}  // namespace
}  // namespace telesplat::launcher
