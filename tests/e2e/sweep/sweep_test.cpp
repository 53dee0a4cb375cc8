// `telesplat sweep` with real runs: carried out, interrupted, gone on with, grown, and refused.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class Sweeps : public ::testing::Test {
 protected:
  Sweeps() { write_terrain(folder / "terrain.ply", 20); }

  // A sweep into DIR/sweep of runs of some frames each.
  std::vector<std::string> words(std::vector<std::string> own, const std::string& scene = "terrain.ply") const {
    std::vector<std::string> out{"sweep", "--out", folder / "sweep"};
    if (!scene.empty()) out.push_back(folder / scene);
    out.insert(out.end(), own.begin(), own.end());
    out.insert(out.end(), {"--", "--cache", folder / "cache", "--size", "160x100", "--frames", "8", "--sampler-threads",
                           "1", "--record-points", "0"});
    return out;
  }
  nlohmann::json manifest() const {
    return nlohmann::json::parse(read_text(folder / "sweep/sweep.json"), nullptr, false);
  }
  size_t done() const {
    size_t out = 0;
    const auto m = manifest();
    if (m.is_object())
      for (const auto& run : m["runs"]) out += run["done"] == true;
    return out;
  }
  std::string summary_id(const std::string& run) const {
    return nlohmann::json::parse(read_text(folder / "sweep/" + run + "/summary.json")).value("id", std::string());
  }

  TemporaryFolder folder;
};

TEST_F(Sweeps, GoOnWhereTheyWereInterrupted) {
  const auto grid = words({"--vary", "coupling=sync,async", "--repeat", "2"});
  Program first("telesplat", grid, folder / "first");
  ASSERT_TRUE(wait_until([&] { return done() == 1 || first.wait(0) >= 0; }, 90)) << first.err();
  first.signal(SIGINT);
  EXPECT_EQ(first.wait(60), 130) << first.err();
  EXPECT_NE(first.err().find("of 4 runs are done, telesplat sweep --out " + folder.path() + "/sweep goes on"),
            std::string::npos)
      << first.err();
  const size_t before = done();
  EXPECT_GE(before, 1u);
  EXPECT_LT(before, 4u);
  EXPECT_TRUE(fs::exists(folder / "sweep/report.html")) << "what is there is told";
  const std::string id = summary_id("coupling-sync/1");
  EXPECT_FALSE(id.empty());

  Program second("telesplat", {"sweep", "--out", folder / "sweep"}, folder / "second");
  ASSERT_EQ(second.wait(120), 0) << second.err();
  EXPECT_EQ(done(), 4u);
  EXPECT_EQ(summary_id("coupling-sync/1"), id) << "what was done is not done again";
  EXPECT_NE(read_text(folder / "sweep/coupling-async/2/summary.json").find("\"label\": \"coupling=async, run 2\""),
            std::string::npos);
  EXPECT_NE(read_text(folder / "sweep/cells.csv").find("\ncoupling-async,async,motion_to_photon_ms.median,2,"),
            std::string::npos);
  EXPECT_NE(second.out().find("! two runs of each configuration"), std::string::npos) << second.out();
  EXPECT_NE(second.out().find("2/2"), std::string::npos) << second.out();
  const auto table = tools::CsvTable::read(folder / "sweep/sweep.csv", {});
  ASSERT_TRUE(table) << table.error().text;
  ASSERT_EQ(table->rows(), 4u);
  for (size_t row = 0; row < 4; ++row) {
    EXPECT_EQ(table->text(row, *table->column("state")), "done");
    EXPECT_EQ(table->text(row, *table->column("flag.coupling")), row < 2 ? "sync" : "async");
    // A run may draw the frame that it began when its number was reached.
    EXPECT_GE(*table->number(row, *table->column("frames")), 8);
    EXPECT_GT(*table->number(row, *table->column("inter_frame_delay_ms.median")), 0);
  }

  // A larger grid goes on with what is there; one that lacks something is another.
  Program larger("telesplat", words({"--vary", "coupling=sync,async,loose", "--repeat", "2", "--dry-run"}),
                 folder / "larger");
  EXPECT_EQ(larger.wait(30), 0) << larger.err();
  EXPECT_NE(larger.out().find("6 runs (3 configurations, 2 times each), 2 to do"), std::string::npos) << larger.out();
  EXPECT_NE(larger.out().find("--coupling=loose"), std::string::npos) << larger.out();
  Program other("telesplat", words({"--vary", "coupling=loose"}), folder / "other");
  EXPECT_EQ(other.wait(30), 2);
  EXPECT_NE(other.err().find("holds another sweep: it has coupling=sync, too"), std::string::npos) << other.err();
  EXPECT_EQ(done(), 4u);
}

TEST_F(Sweeps, ARunThatFailsTwiceIsToldAndTheOthersGoOn) {
  std::ofstream(folder / "broken.ply") << "ply\nformat ascii 1.0\nelement vertex 3\nnonsense\n";
  const std::string scenes = "scene=" + (folder / "broken.ply") + "," + (folder / "terrain.ply");
  Program sweep("telesplat", words({"--vary", scenes, "--repeat", "1"}, ""), folder / "sweep-run");
  EXPECT_EQ(sweep.wait(120), 1) << sweep.err();
  EXPECT_NE(sweep.err().find("it is tried again"), std::string::npos) << sweep.err();
  EXPECT_NE(sweep.out().find("failed: scene=broken, run 1: exit code 2: "), std::string::npos) << sweep.out();
  EXPECT_EQ(done(), 1u);
  const auto told = manifest();
  for (const auto& run : told["runs"]) {
    const bool broken = run["configuration"] == "scene-broken";
    EXPECT_EQ(run["done"], !broken);
    EXPECT_EQ(run["attempts"], broken ? 2 : 1);
  }
  EXPECT_NE(read_text(folder / "sweep/report.html").find("exit code 2"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::test
