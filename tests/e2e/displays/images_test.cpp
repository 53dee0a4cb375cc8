// --coupling images: samplers draw views, which come as pictures.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

TEST(Images, EachFrameShowsANewerPictureThatLooksAsTheSceneDoes) {
  PipelineRun run({"--coupling", "images", "--image-quality", "90", "--size", "320x200", "--duration", "6", "--frames",
                   "60", "--samplers", "2", "--verify", "10", "--verify-samples", "1", "--record-points", "0"});
  ASSERT_EQ(run.program().wait(140), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["coupling"], "images");
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_EQ(s["frames_by_coupling"]["images"], s["frames"]);
  EXPECT_EQ(s["points_cached"], nullptr) << "nobody made points";
  for (const char* of_points : {"points cached", "redundancy eliminated", "splats"})
    EXPECT_EQ(run.program().out().find(of_points), std::string::npos) << run.program().out();
  EXPECT_GT(s["bytes_sent"], 0);
  ASSERT_GT(s["quality"]["views"], 0);
  // One ray a pixel on both sides: what differs is what JPEG loses.
  EXPECT_GT(s["quality"]["ssim"]["median"], 0.9);
  EXPECT_GT(s["quality"]["psnr_db"]["median"], 28);

  const auto requests = run.column("frames.csv", "request"), errors = run.column("frames.csv", "view_error_m");
  ASSERT_GT(requests.size(), 5u);
  EXPECT_TRUE(std::is_sorted(requests.begin(), requests.end()));
  const size_t shown = std::set<double>(requests.begin(), requests.end()).size();
  EXPECT_LE(requests.size() - shown, size_t(kSlow ? 6 : 2)) << "two frames of one picture, though the head moves";
  EXPECT_GT(*std::max_element(errors.begin(), errors.end()), 0) << "a picture is of where the head was";
  const auto updates = run.column("updates.csv", "request"), bytes = run.column("updates.csv", "bytes");
  const std::set<double> known(updates.begin(), updates.end());
  for (const double r : requests) EXPECT_TRUE(known.contains(r)) << "request " << r << " has no update";
  EXPECT_GT(*std::min_element(bytes.begin(), bytes.end()), 500);
}

// The last picture of a head that came to rest, against four rays a pixel, as it is drawn then.
TEST(ImagesAtRest, AFinerPictureFollowsAndThenNothing) {
  PipelineRun run({"--coupling", "images", "--image-quality", "20", "--size", "320x200", "--trajectory", "still",
                   "--duration", "3", "--verify", "1000", "--verify-samples", "4", "--record-points", "0"});
  ASSERT_TRUE(run.wait_status([](const auto& status) { return value(status, "viewer-1", "frames") > 0; }));
  std::string err;
  EXPECT_EQ(ctl(run, {"coupling", "sync"}, nullptr, &err), 2);
  EXPECT_NE(err.find("from its beginning to its end"), std::string::npos) << err;
  ASSERT_EQ(run.program().wait(140), 0) << run.program().err();
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["updates"], 2) << "the view, and once more";
  EXPECT_GT(s["frames"], 10) << "the display goes on";
  const auto bytes = run.column("updates.csv", "bytes");
  ASSERT_EQ(bytes.size(), 2u);
  EXPECT_GT(bytes[1], 1.5 * bytes[0]);
  const auto quality = tools::CsvTable::read(run.out() + "/quality.csv", {});
  ASSERT_TRUE(quality) << quality.error().text;
  ASSERT_GE(quality->rows(), 2u);
  const size_t ssim = *quality->column("ssim");
  EXPECT_GT(*quality->number(quality->rows() - 1, ssim), *quality->number(0, ssim));
  EXPECT_GT(*quality->number(quality->rows() - 1, ssim), 0.95);
}

TEST(ImagesSwept, BesideAsyncAndByQuality) {
  TemporaryFolder folder;
  write_terrain(folder / "terrain.ply", 60);
  Program sweep("telesplat",
                {"sweep",
                 folder / "terrain.ply",
                 "--out",
                 folder / "sweep",
                 "--repeat",
                 "1",
                 "--vary",
                 "coupling=async,images",
                 "--vary",
                 "image-quality=15,90",
                 "--",
                 "--cache",
                 folder / "cache",
                 "--size",
                 "320x200",
                 "--frames",
                 "30",
                 "--verify",
                 "10",
                 "--record-points",
                 "0"},
                folder / "out");
  ASSERT_EQ(sweep.wait(200), 0) << sweep.err();
  const auto table = tools::CsvTable::read(folder / "sweep/sweep.csv", {});
  ASSERT_TRUE(table) << table.error().text;
  ASSERT_EQ(table->rows(), 4u);
  const auto at = [&](size_t row, const char* column) {
    const auto number = table->number(row, *table->column(column));
    return number ? *number : -1;
  };
  EXPECT_EQ(table->text(2, *table->column("flag.coupling")), "images");
  EXPECT_LT(at(2, "quality.ssim.median"), at(3, "quality.ssim.median"));
  EXPECT_LT(at(2, "bytes_sent") / at(2, "frames"), at(3, "bytes_sent") / at(3, "frames"));
  EXPECT_NE(sweep.out().find("SSIM"), std::string::npos) << "couplings compare where it is equal: " << sweep.out();
}

}  // namespace
}  // namespace telesplat::test
