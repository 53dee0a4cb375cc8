// `telesplat bench thesis` with real runs: its figures are drawn, and what is done is not done again.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class ThesisBench : public ::testing::Test {
 protected:
  ThesisBench() {
    fs::create_directories(folder / "data/meshes");
    write_terrain(folder / "data/meshes/colorado-5760k.ply", 20);
  }
  std::vector<std::string> words(std::vector<std::string> own) const {
    std::vector<std::string> out{"bench", "thesis", "--out", folder / "thesis", "--data", folder / "data"};
    out.insert(out.end(), own.begin(), own.end());
    return out;
  }
  nlohmann::json state() const {
    return nlohmann::json::parse(read_text(folder / "thesis/thesis.json"), nullptr, false);
  }
  size_t done() const { return state().is_object() ? state()["done"].size() : 0; }

  TemporaryFolder folder;
};

TEST_F(ThesisBench, DrawsTimelinesOfTheThreeCouplings) {
  Program first("telesplat", words({"--quick", "--only", "6"}), folder / "first");
  ASSERT_TRUE(wait_until([&] { return done() == 1 || first.wait(0) >= 0; }, 120)) << first.err();
  first.signal(SIGINT);
  EXPECT_EQ(first.wait(60), 130) << first.err();
  EXPECT_NE(first.err().find("interrupted; the same command goes on"), std::string::npos) << first.err();
  const auto before = state();
  ASSERT_TRUE(before.is_object());
  EXPECT_LT(before["done"].size(), 3u);

  Program second("telesplat", words({"--quick", "--only", "6"}), folder / "second");
  ASSERT_EQ(second.wait(180), 0) << second.err();
  EXPECT_EQ(done(), 3u);
  EXPECT_EQ(state()["done"]["figure 6.1, sync coupling"], before["done"]["figure 6.1, sync coupling"]);
  for (const char* figure : {"6.1", "6.2", "6.3"}) {
    const std::string svg = read_text(folder / "thesis/figure-" + figure + ".svg");
    EXPECT_NE(svg.find("display frame: "), std::string::npos) << figure;
    EXPECT_NE(svg.find("sample: "), std::string::npos) << figure << " has no server";
    EXPECT_NE(read_text(folder / "thesis/thesis.md").find(std::string("![Figure ") + figure), std::string::npos);
  }
  EXPECT_NE(read_text(folder / "thesis/thesis.html").find("Figure 6.3: workflow timeline"), std::string::npos);

  Program mixed("telesplat", words({"--only", "6"}), folder / "mixed");
  EXPECT_EQ(mixed.wait(30), 2);
  EXPECT_EQ(mixed.err(), "telesplat: --out " + (folder / "thesis") +
                             ": holds another record of bench thesis: it was begun with --quick, not without; name all "
                             "that it has, or give another --out\n");
}

// The steps of one folder are of the same data; a step that needs none goes into any.
TEST_F(ThesisBench, GoesOnWithTheDataItWasBegunWithAndNoOther) {
  fs::create_directories(folder / "other/meshes");
  write_terrain(folder / "other/meshes/colorado-5760k.ply", 20);
  const std::string data = folder / "data", other = folder / "other", out = folder / "thesis";
  const auto begun = [&](const nlohmann::json& state) {
    fs::create_directories(out);
    std::ofstream(out + "/thesis.json") << state;
  };
  int n = 0;
  const auto asked = [&](std::vector<std::string> own) {
    std::vector<std::string> all{"bench", "thesis", "--out", out, "--dry-run"};
    all.insert(all.end(), own.begin(), own.end());
    Program program("telesplat", all, folder / fmt::format("asked-{}", n++));
    const int code = program.wait(30);
    return std::pair(code, program.err());
  };
  begun({{"quick", false}, {"data", data}, {"done", nlohmann::json::object()}});
  EXPECT_EQ(asked({"--only", "6", "--data", data + "/"}).first, 0);
  const auto refused = asked({"--only", "6", "--data", other});
  EXPECT_EQ(refused.first, 2);
  EXPECT_EQ(refused.second, "telesplat: --out " + out +
                                ": holds another record of bench thesis: it was begun with --data " + data + ", not " +
                                other + "; name all that it has, or give another --out\n");
  EXPECT_EQ(asked({"--only", "7.2", "--data", other}).first, 0) << "it needs no data";
  // Records of earlier versions do not tell.
  begun({{"quick", false}, {"done", nlohmann::json::object()}});
  EXPECT_EQ(asked({"--only", "6", "--data", other}).first, 0);
  begun({{"quick", false}, {"data", 5}, {"done", nlohmann::json::object()}});
  EXPECT_EQ(asked({"--only", "6", "--data", other}).first, 2);
}

TEST_F(ThesisBench, ChecksItsDataFirst) {
  Program missing("telesplat", words({"--only", "7.1"}), folder / "missing");
  EXPECT_EQ(missing.wait(30), 2);
  EXPECT_NE(missing.err().find("meshes/crater-lake-srtm3-2880k.ply"), std::string::npos) << missing.err();
  EXPECT_FALSE(fs::exists(folder / "thesis"));
  Program wrong("telesplat", words({"--only", "7.9"}), folder / "wrong");
  EXPECT_EQ(wrong.wait(30), 2);
  EXPECT_EQ(wrong.err(), "telesplat: --only 7.9: \"7.9\" is none of 6, 7.1, 7.2, 7.3, 7.4\n");
  Program listed("telesplat", words({"--only", "7.4", "--dry-run"}), folder / "listed");
  EXPECT_EQ(listed.wait(30), 0);
  EXPECT_NE(listed.out().find("--samplers 1,2,3,4,5,6 --viewers 1,2,3,4"), std::string::npos) << listed.out();
  EXPECT_FALSE(fs::exists(folder / "thesis"));
}

TEST_F(ThesisBench, EveryPictureOfTheScalingStudyIsSampledWhole) {
  // The same view again, with two samplers: half the waits are left, not less.
  Program scaling("telesplat",
                  {"bench", "scaling", "--no-kill", "--nodes", "1,2", "--frames", "2", "--row-cost", "1.5", "--size",
                   "64x40", "--out", folder / "scaling"},
                  folder / "scaling-run");
  ASSERT_EQ(scaling.wait(120), 0) << scaling.err();
  const auto table = tools::CsvTable::read(folder / "scaling/scaling.csv", {});
  ASSERT_TRUE(table) << table.error().text;
  const auto simulated = *table->column("simulated");
  size_t rows = 0;
  for (size_t row = 0; row < table->rows(); ++row) {
    if (*table->number(row, simulated) == 0) continue;
    ++rows;
    const double nodes = *table->number(row, *table->column("nodes")),
                 time_s = *table->number(row, *table->column("time_s"));
    EXPECT_GE(time_s, 0.9 * 1.5 / nodes) << nodes << " nodes";
  }
  EXPECT_EQ(rows, 2u);
  const auto report = nlohmann::json::parse(read_text(folder / "scaling/scaling.json"));
  ASSERT_FALSE(report["computed"].empty());
  for (const auto& c : report["computed"]) {
    EXPECT_EQ(c["busy_s"].size(), c["samplers"]);
    for (const double busy_s : c["busy_s"]) EXPECT_GT(busy_s, 0);
  }
}

}  // namespace
}  // namespace telesplat::test
