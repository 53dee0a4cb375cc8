// Volumes: whole runs of a small one, made here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>

#include "common/image/file.h"
#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// Balls of tinted glass around a rod.
constexpr const char* kGlass =
    "0:#000000:0,60:#204080:0,150:#40a0e0:0.08,200:#f0a040:0.2,240:#f0a040:0.2,250:#ffffff:0.9";

/// The volume of a test, in a folder of its own.
class VolumeRun : public ::testing::Test {
 protected:
  VolumeRun() { write_volume(volume()); }
  std::string volume() const { return folder_ / "balls.mha"; }
  static std::vector<std::string> with(std::vector<std::string> more) {
    more.insert(more.begin(), {"--sampling-size", "auto"});
    return more;
  }
  TemporaryFolder folder_;
};

std::vector<std::string> texts(const PipelineRun& run, const std::string& file, const std::string& name) {
  std::vector<std::string> out;
  std::ifstream in(run.out() + "/" + file);
  std::string line;
  std::getline(in, line);
  const auto header = tools::csv_fields(line).value_or(std::vector<std::string>{});
  const size_t at = size_t(std::find(header.begin(), header.end(), name) - header.begin());
  while (at < header.size() && std::getline(in, line))
    if (const auto fields = tools::csv_fields(line); fields && at < fields->size()) out.push_back((*fields)[at]);
  return out;
}

TEST_F(VolumeRun, WhatIsDisplayedIsWhatRaysSee) {
  auto flags = with(kComesToRest);
  flags.insert(flags.end(), {"--tf", kGlass, "--verify", "60", "--samplers", "2"});
  PipelineRun run(flags, volume());
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["kind"], "volume");
  EXPECT_EQ(s["scene"], "balls.mha");
  EXPECT_EQ(s["samplers"], 2);
  EXPECT_GT(s["updates"], 2);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_GE(s["quality"]["views"], 2);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], 26);
  // The head stands still, and what it sees was sampled from there.
  EXPECT_GT(s["quality"]["last_view"]["psnr_db"], 32);
  EXPECT_NE(run.program().out().find("balls.mha"), std::string::npos) << run.program().out();
  // Both samplers take part in every frame: the volume is cut in two.
  const auto samplers = texts(run, "tiles.csv", "sampler");
  EXPECT_EQ(std::set<std::string>(samplers.begin(), samplers.end()), (std::set<std::string>{"sampler-1", "sampler-2"}));

  Program inspect("telesplat", {"inspect", run.out()}, run.folder() / "inspect");
  EXPECT_EQ(inspect.wait(), 0) << inspect.err();
  EXPECT_NE(inspect.out().find("summary.json"), std::string::npos);
  Program compare("telesplat", {"compare", run.out()}, run.folder() / "compare");
  EXPECT_EQ(compare.wait(), 2);
  EXPECT_NE(compare.err().find("volume"), std::string::npos) << compare.err();
}

TEST_F(VolumeRun, AWallOfManyProcessesShowsWhatASingleViewerShows) {
  auto common = kComesToRest;
  common.insert(common.end(), {"--tf", kGlass, "--target-fps", "20"});
  auto arguments = common;
  // 2 x 2 screens of 320 x 200 pixels, together a display of 60 degrees.
  std::ofstream(folder_ / "wall.toml")
      << "[wall]\nanchor = \"head\"\n[head]\nposition = [0, 0, 1]\n[[planar]]\ncolumns = 2\nrows = 2\n"
         "size = [0.5773502691896258, 0.3608439182435161]\nresolution = [320, 200]\n";
  arguments.insert(arguments.end(), {"--data-servers", "2", "--samplers", "3", "--wall", folder_ / "wall.toml"});
  PipelineRun wall(with(arguments), volume());
  ASSERT_TRUE(wall.wait_at_rest()) << wall.program().err();
  ASSERT_EQ(wall.stop(), 0) << wall.program().err();
  EXPECT_TRUE(wall.all_gone());
  EXPECT_NE(wall.program().out().find("viewer-4 frame"), std::string::npos) << wall.program().out();
  const auto s = wall.summary();
  EXPECT_EQ(s["samplers"], 3);
  EXPECT_EQ(s["viewers"], 4);
  EXPECT_GT(s["swaps"], 10) << "in step";
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);

  arguments = common;
  arguments.insert(arguments.end(), {"--size", "640x400", "--fov", "60"});
  PipelineRun single(with(arguments), volume());
  ASSERT_TRUE(single.wait_at_rest()) << single.program().err();
  ASSERT_EQ(single.stop(), 0) << single.program().err();
  const auto stitched = image::read_view(wall.out() + "/images/wall.png"),
             whole = image::read_view(newest_picture(single));
  ASSERT_TRUE(stitched.ok()) << stitched.error().text;
  ASSERT_TRUE(whole.ok()) << whole.error().text;
  ASSERT_EQ(stitched->width, 640);
  ASSERT_EQ(stitched->height, 400);
  ASSERT_EQ(whole->width, 640);
  EXPECT_GT(psnr_db(*whole, *stitched), 42);  // 48 dB; tiles may have been sampled on rasters of their own

  // At the seam neighbours differ no more than in the single viewer's picture, where the same two columns are
  // neighbours, too.
  const auto step = [](const image::View& v, int x) {
    double sum = 0;
    for (int y = 0; y < v.height; ++y)
      for (const int shift : {0, 8, 16}) {
        const uint32_t* row = &v.colour[size_t(y) * v.width];
        sum += std::abs(int(row[x - 1] >> shift & 255) - int(row[x] >> shift & 255));
      }
    return sum / v.height / 3;
  };
  EXPECT_NEAR(step(*stitched, 320), step(*whole, 320), 1.0);  // levels, 255 at most
}

TEST_F(VolumeRun, ANewTransferFunctionIsANewEpoch) {
  PipelineRun run(
      with({"--tf", kGlass, "--duration", "0", "--trajectory", "still", "--target-fps", "20", "--verify", "30"}),
      volume());
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "frames") > 0; })) << run.program().err();
  std::string err;
  EXPECT_EQ(ctl(run, {"tf", "0:#000000:0,100:#ff0000:0,160:#ff0000:0.6"}), 0);
  EXPECT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "epoch") == 2; }))
      << run.status().dump(1);
  EXPECT_EQ(ctl(run, {"tf", "bone"}), 0);
  EXPECT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "epoch") == 3; }));
  // A colour-map file's points lie between 0 and 1 and are spread over the volume's range.
  std::ofstream(run.folder() / "map.json")
      << R"([{"Name": "two", "RGBPoints": [0, 0, 0, 1, 1, 1, 1, 0], "Points": [0, 0, 0.5, 0, 1, 0.8, 0.5, 0]}])";
  EXPECT_EQ(ctl(run, {"tf", run.folder() / "map.json:two"}, nullptr, &err), 0) << err;
  EXPECT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "epoch") == 4; }));
  const double updates = value(run.status(), "viewer-1", "updates");
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") > updates + 1; }));
  EXPECT_EQ(ctl(run, {"tf", run.folder() / "map.json:three"}, nullptr, &err), 2);
  EXPECT_NE(err.find("\"three\""), std::string::npos) << err;

  EXPECT_NE(ctl(run, {"tf", "nonesuch"}, nullptr, &err), 0);
  EXPECT_NE(err.find("nonesuch"), std::string::npos) << err;
  EXPECT_NE(ctl(run, {"tf", "5:#00:0"}), 0);
  EXPECT_EQ(ctl(run, {"tf"}), 2);
  // An order that the master refuses is bad usage as well.
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"tf", "0:#000000:7"},
                                                {"set", "volume.step=7"},
                                                {"set", "c.y=0.3"},
                                                {"animate", "on"}}) {
    EXPECT_EQ(ctl(run, wrong, nullptr, &err), 2) << wrong[0] << ": " << err;
    EXPECT_TRUE(err.starts_with("telesplat: ")) << err;
  }
  EXPECT_EQ(ctl(run, {"tf", run.folder() / "none.json"}, nullptr, &err), 2);
  EXPECT_NE(err.find("none.json"), std::string::npos) << err;
  std::ofstream(run.folder() / "broken.json") << "{\"RGBPoints\": [0, 1";
  EXPECT_EQ(ctl(run, {"tf", run.folder() / "broken.json"}), 2);
  EXPECT_EQ(value(run.status(), "viewer-1", "epoch"), 4) << "what was refused changed something";

  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto transfers = texts(run, "epochs.csv", "transfer");
  ASSERT_EQ(transfers.size(), 4u);
  EXPECT_EQ(std::set<std::string>(transfers.begin(), transfers.end()).size(), 4u);
  const auto epochs = run.column("frames.csv", "epoch");
  EXPECT_TRUE(std::is_sorted(epochs.begin(), epochs.end()));
  EXPECT_EQ(std::set<double>(epochs.begin(), epochs.end()), (std::set<double>{1, 2, 3, 4}));
  // Each frame is compared with rays through its own epoch's volume.
  const auto s = run.summary();
  EXPECT_GE(s["quality"]["views"], 2);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], 30);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0) << "what was refused was no wrong message";
  EXPECT_TRUE(run.all_gone());
}

TEST_F(VolumeRun, ASeriesPlaysAndStands) {
  const std::string series = folder_ / "series";
  fs::create_directory(series);
  for (int i = 0; i < 4; ++i) write_volume(series + "/phase" + std::to_string(i) + ".mha", 32, i / 4.0);
  PipelineRun run(with({"--tf", kGlass, "--series-rate", "8", "--duration", "0", "--trajectory", "still",
                        "--target-fps", "20", "--verify", "10"}),
                  series);
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    const auto played = run.column("epochs.csv", "volume.step");
    return value(s, "viewer-1", "epoch") >= 7 && std::set<double>(played.begin(), played.end()).size() == 4;
  })) << run.program().err();
  EXPECT_EQ(ctl(run, {"set", "volume.step=2"}), 0);
  EXPECT_NE(ctl(run, {"set", "volume.step=4"}), 0);
  EXPECT_TRUE(run.wait_status([](const auto& s) { return s["parameters"].value("volume.step", -1.0) == 2; }));
  const double stopped = run.status()["epoch"];
  const double updates = value(run.status(), "viewer-1", "updates");
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") > updates + 3; }));
  EXPECT_EQ(run.status()["epoch"], stopped) << "it plays on";
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto steps = run.column("epochs.csv", "volume.step");
  EXPECT_EQ(steps.back(), 2);
  const auto shown = run.column("frames.csv", "epoch");
  EXPECT_TRUE(std::is_sorted(shown.begin(), shown.end()));
  EXPECT_GT(std::set<double>(shown.begin(), shown.end()).size(), 4u);
  // Every frame against its own step: another step's volume would be 20 dB off.
  const auto s = run.summary();
  EXPECT_GE(s["quality"]["views"], 2);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], 30);
  EXPECT_TRUE(run.all_gone());
}

TEST_F(VolumeRun, TheSurfaceOfARawVolumeIsShownVerifiedAndCompared) {
  const std::string mha = read_text(volume());
  std::ofstream(folder_ / "balls.raw", std::ios::binary) << mha.substr(mha.size() - 40 * 40 * 40);
  auto flags = kComesToRest;
  flags.insert(flags.end(), {"--raw", "40x40x40:u8", "--iso", "100", "--verify", "60"});
  PipelineRun run(flags, folder_ / "balls.raw");
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  EXPECT_EQ(s["kind"], "mesh");
  EXPECT_EQ(s["scene"], "balls.raw");
  EXPECT_GT(s["primitives"], 1000);
  EXPECT_GT(s["quality"]["last_view"]["psnr_db"], 22);
  EXPECT_LT(s["quality"]["last_view"]["hole_fraction"], 0.02);
  // The folder alone tells how the surface is made again.
  Program compare("telesplat",
                  {"compare", run.out(), "--kernels", "disc", "--renderers", "cpu", "--poses", "1", "--repeat", "1"},
                  run.folder() / "compare");
  EXPECT_EQ(compare.wait(90), 0) << compare.err();
  EXPECT_TRUE(fs::exists(run.out() + "/compare/contact-sheet.png"));
}

TEST(VolumeFaults, ASamplerAndADataServerThatDieAreStartedAgain) {
  TemporaryFolder folder;
  write_volume(folder / "balls.mha");
  PipelineRun run(
      {"--sampling-size", "auto", "--tf", kGlass, "--duration", "0", "--samplers", "2", "--data-servers", "2"},
      folder / "balls.mha");
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "frames") > 0; })) << run.program().err();
  for (const std::string name : {"sampler-2", "data-2"}) {
    pid_t victim = 0;
    ASSERT_TRUE(run.wait_status([&](const auto& s) {
      const auto p = process(s, name);
      return p.is_object() && (victim = p["pid"].template get<pid_t>()) > 0;
    }));
    ::kill(victim, SIGKILL);
    EXPECT_TRUE(wait_until([&] { return run.program().err().find(name + " died") != std::string::npos; }));
    EXPECT_TRUE(run.wait_status([&](const auto& s) {
      const auto p = process(s, name);
      return p.is_object() && p["pid"].template get<pid_t>() != victim;
    }));
    const double updates = value(run.status(), "viewer-1", "updates");
    EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") > updates + 3; }))
        << name << run.status().dump(1);
  }
  // A new transfer function needs voxels of both parts.
  const double epoch = value(run.status(), "viewer-1", "epoch");
  EXPECT_EQ(ctl(run, {"tf", "0:#000000:0,20:#ff0000:0,160:#ff0000:0.6"}), 0);
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "epoch") > epoch; }))
      << run.status().dump(1);
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
}

TEST_F(VolumeRun, CtrlCEndsAWall) {
  PipelineRun run(with({"--tf", kGlass, "--duration", "0", "--wall", "2x1", "--size", "160x200"}), volume());
  ASSERT_TRUE(run.wait_status([](const auto& s) {
    return value(s, "viewer-1", "frames") > 0 && value(s, "viewer-2", "frames") > 0;
  })) << run.program().err();
  run.program().signal(SIGINT);
  EXPECT_EQ(run.program().wait(60), 0) << "a run without an end: " << run.program().err();
  EXPECT_EQ(run.program().err().find("interrupted"), std::string::npos) << run.program().err();
  EXPECT_TRUE(run.all_gone());
}

}  // namespace
}  // namespace telesplat::test
