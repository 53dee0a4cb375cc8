// Walls of screens: what they show together, that they show it together, and what becomes of them when one goes.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>

#include "common/image/file.h"
#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// 2 x 2 screens of 160 x 100 pixels, together a display of 60 degrees.
constexpr const char* kPlane =
    "[wall]\nanchor = \"head\"\n[head]\nposition = [0, 0, 1]\n[[planar]]\ncolumns = 2\nrows = 2\n"
    "size = [0.5773502691896258, 0.3608439182435161]\nresolution = [160, 100]\n";

std::string write_wall(const TemporaryFolder& folder, const char* text = kPlane) {
  const std::string path = folder / "lab.toml";
  std::ofstream(path) << text;
  return path;
}

struct Row {
  std::string viewer;
  double wall_frame, swap_skew_ms, sequence, px, py, pz, epoch;
};
std::vector<Row> frames(const PipelineRun& run) {
  std::vector<Row> out;
  const auto table = tools::CsvTable::read(run.out() + "/frames.csv", {});
  EXPECT_TRUE(table.ok()) << (table ? "" : table.error().text);
  if (!table) return out;
  const auto number = [&](size_t row, const char* name) { return table->number(row, *table->find(name)).value(); };
  for (size_t row = 0; row < table->rows(); ++row)
    out.push_back({std::string(table->text(row, *table->find("viewer"))), number(row, "wall_frame"),
                   number(row, "swap_skew_ms"), number(row, "sequence"), number(row, "px"), number(row, "py"),
                   number(row, "pz"), number(row, "epoch")});
  return out;
}

// All rows of one frame of the wall have one head and one state.
void expect_in_step(const std::vector<Row>& rows) {
  std::map<double, std::vector<Row>> by_frame;
  for (const Row& r : rows)
    if (r.wall_frame > 0) by_frame[r.wall_frame].push_back(r);
  size_t whole = 0, apart = 0;
  for (const auto& [number, of_frame] : by_frame) {
    whole += of_frame.size() == 4;
    for (const Row& r : of_frame) {
      EXPECT_EQ(r.px, of_frame[0].px) << number;
      EXPECT_EQ(r.pz, of_frame[0].pz) << number;
      apart += r.sequence != of_frame[0].sequence || r.epoch != of_frame[0].epoch;
    }
  }
  EXPECT_GT(whole, by_frame.size() * 8 / 10) << "of " << by_frame.size() << " frames most are presented by all";
  EXPECT_LT(apart, rows.size() / 50) << "of " << rows.size() << " rows";
}

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.end(), kComesToRest.begin(), kComesToRest.end());
  more.insert(more.end(), {"--target-fps", "20"});
  return more;
}

// The picture of the wall, and that of a single display of the same field of view.
TEST(Wall, FourScreensShowWhatOneDisplayShows) {
  TemporaryFolder folder;
  PipelineRun wall(with({"--wall", write_wall(folder), "--sampling-size", "auto", "--detail-budget", "off"}));
  ASSERT_TRUE(wall.wait_at_rest()) << wall.program().err();
  ASSERT_EQ(wall.stop(), 0) << wall.program().err();
  EXPECT_TRUE(wall.all_gone());
  const auto s = wall.summary();
  EXPECT_EQ(s["viewers"], 4);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_GT(s["swaps"], 10);
  EXPECT_GT(s["swap_skew_ms"]["median"], 0);
  EXPECT_LT(s["swap_skew_ms"]["median"], 50) << "frames of 50 ms";
  expect_in_step(frames(wall));
  EXPECT_TRUE(fs::exists(wall.out() + "/wall.toml"));

  PipelineRun single(with({"--size", "320x200", "--fov", "60", "--sampling-size", "auto"}));
  ASSERT_TRUE(single.wait_at_rest()) << single.program().err();
  ASSERT_EQ(single.stop(), 0) << single.program().err();
  const auto stitched = image::read_view(wall.out() + "/images/wall.png"),
             whole = image::read_view(newest_picture(single));
  ASSERT_TRUE(stitched.ok()) << stitched.error().text;
  ASSERT_TRUE(whole.ok()) << whole.error().text;
  ASSERT_EQ(stitched->width, 320);
  ASSERT_EQ(stitched->height, 200);
  EXPECT_GT(psnr_db(*whole, *stitched), 30);
}

TEST(Wall, ADisplayThatStopsDoesNotHoldTheOthers) {
  TemporaryFolder folder;
  PipelineRun run({"--wall", write_wall(folder), "--duration", "0", "--target-fps", "20"});
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "frames") > 20; }))
      << run.program().err();
  // It is stopped, not dead: no goodbye is sent.
  pid_t stopped = 0;
  const auto status = run.status();
  for (const auto& p : status["processes"])
    if (p.value("name", "") == "viewer-3") stopped = p.value("pid", 0);
  ASSERT_GT(stopped, 0);
  kill(stopped, SIGSTOP);
  const auto frames_of = [&](const char* name) { return value(run.status(), name, "frames"); };
  const double before = frames_of("viewer-1");
  EXPECT_TRUE(wait_until([&] { return frames_of("viewer-1") > before + 30; }, 10)) << "the others are held";
  kill(stopped, SIGCONT);
  const double then = frames_of("viewer-3");
  EXPECT_TRUE(wait_until([&] { return frames_of("viewer-3") > then + 20; }, 10)) << "it does not come back";
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_GE(run.summary()["swaps_incomplete"], 1);
}

TEST(Wall, ACylinderIsUnrolled) {
  TemporaryFolder folder;
  const std::string arc =
      "[wall]\nanchor = \"head\"\n[head]\nposition = [0, 0, 0]\n[[cylindrical]]\ncolumns = 3\nrows = 2\nradius = "
      "1\nsize = [0.4, 0.3]\nresolution = [80, 60]\nbezel = 0.02\n";
  PipelineRun run({"--wall", write_wall(folder, arc.c_str()), "--duration", "2", "--hold", "1", "--target-fps", "15"});
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  const auto stitched = image::read_view(run.out() + "/images/wall.png");
  ASSERT_TRUE(stitched.ok()) << stitched.error().text;
  EXPECT_EQ(stitched->width, 3 * 80 + 2 * 8);  // a pixel is 5 mm
  EXPECT_EQ(stitched->height, 2 * 60 + 8);
  EXPECT_EQ(stitched->colour[84] & 0xffffff, 0u) << "a bezel";
  const Row first = frames(run).front();
  EXPECT_GT(std::hypot(first.px, first.pz), 0.1) << "frames.csv has the head";
}

}  // namespace
}  // namespace telesplat::test
