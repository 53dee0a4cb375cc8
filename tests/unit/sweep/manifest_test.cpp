// A sweep's manifest: the sweep resumes where it stopped, grows, and does not mix with another.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tools/telesplat/sweep/manifest.h"
#include "tools/telesplat/sweep/sweep.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

Grid small() {
  Grid out;
  out.scene = "julia";
  out.flags = {"--duration", "2"};
  out.axes = {{"coupling", {"sync", "async"}}, {"samplers", {"1", "2"}}};
  out.repeat = 2;
  return out;
}

RunOutcome done_in(double wall_s) {
  return {.done = true, .attempts = 1, .exit_code = 0, .reason = {}, .begin = "now", .wall_s = wall_s};
}

class SweepManifest : public ::testing::Test {
 protected:
  SweepManifest() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-sweep-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~SweepManifest() override { fs::remove_all(folder); }
  void complete(const Manifest& m, size_t configuration, int repetition) const {
    const std::string run = folder + "/" + m.configurations[configuration].name + "/" + std::to_string(repetition);
    fs::create_directories(run);
    std::ofstream(run + "/summary.json") << "{}";
  }
  static std::string list(const std::vector<NextRun>& runs) {
    std::string out;
    for (const auto& r : runs) out += std::to_string(r.configuration) + "/" + std::to_string(r.repetition) + " ";
    return out;
  }
  std::string folder;
};

TEST_F(SweepManifest, ComesBackAsItWasWritten) {
  Manifest m = begin_manifest(small(), "1.0", "/here");
  m.grid.shuffle = 5;
  m.outcomes[{"coupling-sync_samplers-1", 2}] = {
      false, 2, 130, "exit code 130: \"quoted\", and\nmore", "2026-01-01T00:00:00+0000", 12.5};
  ASSERT_TRUE(write_manifest(m, folder));
  const auto read = read_manifest(folder);
  ASSERT_TRUE(read && *read);
  EXPECT_EQ((*read)->grid, m.grid);
  EXPECT_EQ((*read)->version, "1.0");
  EXPECT_EQ((*read)->directory, "/here");
  ASSERT_EQ((*read)->configurations.size(), 4u);
  EXPECT_EQ((*read)->configurations[3].name, "coupling-async_samplers-2");
  ASSERT_EQ((*read)->outcomes.size(), 1u);
  const auto& [key, o] = *(*read)->outcomes.begin();
  EXPECT_EQ(key, (RunKey{"coupling-sync_samplers-1", 2}));
  EXPECT_FALSE(o.done);
  EXPECT_EQ(o.reason, "exit code 130: \"quoted\", and\nmore");
  EXPECT_EQ(o.wall_s, 12.5);
  EXPECT_FALSE(fs::exists(folder + "/sweep.json.part"));
}

TEST_F(SweepManifest, IsNotThereOrSaysWhatIsWrong) {
  const auto none = read_manifest(folder);
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->has_value());
  for (const char* text : {"", "[]", "{\"schema\": 1}", "{\"schema\": 99}"}) {
    std::ofstream(folder + "/sweep.json") << text;
    EXPECT_FALSE(read_manifest(folder)) << text;
  }
  // A name that would put a run's files elsewhere.
  Manifest m = begin_manifest(small(), "1.0", "/here");
  m.configurations[0].name = "../elsewhere";
  ASSERT_TRUE(write_manifest(m, folder));
  EXPECT_FALSE(read_manifest(folder));
}

TEST_F(SweepManifest, GrowsAndKeepsWhatIsDone) {
  Manifest m = begin_manifest(small(), "1.0", "/here");
  m.outcomes[{"coupling-async_samplers-1", 1}] = done_in(3);
  complete(m, 2, 1);
  Grid more = small();
  more.axes = {{"samplers", {"4", "1", "2"}}, {"coupling", {"sync", "loose", "async"}}};
  more.repeat = 3;
  ASSERT_TRUE(extend(m, more));
  ASSERT_EQ(m.configurations.size(), 9u);
  EXPECT_EQ(m.configurations[5].values, (std::vector<std::string>{"1", "async"}));
  EXPECT_EQ(m.configurations[5].name, "coupling-async_samplers-1") << "its folder stays";
  EXPECT_EQ(m.configurations[4].name, "samplers-1_coupling-loose");
  const Sweep sweep(m, folder, "telesplat", 0);
  EXPECT_EQ(sweep.runs(), 27u);
  EXPECT_EQ(sweep.to_do().size(), 26u);
}

TEST_F(SweepManifest, AnotherSweepIsRefusedAndTheDifferenceNamed) {
  const auto wrong = [](auto&& change) {
    Manifest m = begin_manifest(small(), "1.0", "/here");
    Grid other = small();
    change(other);
    const Status s = extend(m, other);
    EXPECT_EQ(m.grid, small()) << "it stays as it was";
    return s ? std::string() : s.error().text;
  };
  EXPECT_EQ(wrong([](Grid& g) { g.scene = "a.ply"; }), "it is of julia, not of a.ply");
  EXPECT_EQ(wrong([](Grid& g) { g.flags.pop_back(); }), "its runs have the flags \"--duration 2\", not \"--duration\"");
  EXPECT_EQ(wrong([](Grid& g) { g.axes.push_back({"splat", {"disc"}}); }), "splat does not vary in it");
  EXPECT_EQ(wrong([](Grid& g) { g.axes.pop_back(); }), "samplers varies in it, too");
  EXPECT_EQ(wrong([](Grid& g) { g.axes[0].values = {"sync", "loose"}; }), "it has coupling=async, too");
  EXPECT_EQ(wrong([](Grid& g) { g.repeat = 1; }), "it has 2 runs of each configuration, not 1");
}

TEST_F(SweepManifest, WhatIsNotDoneIsToDo) {
  Manifest m = begin_manifest(small(), "1.0", "/here");
  EXPECT_EQ(list(Sweep(m, folder, "", 0).to_do()), "0/1 1/1 2/1 3/1 0/2 1/2 2/2 3/2 ");
  for (const auto& c : {0, 1, 2}) m.outcomes[{m.configurations[size_t(c)].name, 1}] = done_in(3);
  m.outcomes[{m.configurations[2].name, 1}].done = false;  // failed: it runs again
  complete(m, 0, 1);
  complete(m, 2, 1);  // the record of configuration 1 is gone
  EXPECT_EQ(list(Sweep(m, folder, "", 0).to_do()), "1/1 2/1 3/1 0/2 1/2 2/2 3/2 ");
}

TEST_F(SweepManifest, ARunThatDidNotEndIsReplaced) {
  const Manifest m = begin_manifest(small(), "1.0", "/here");
  const Sweep sweep(m, folder, "", 0);
  const std::string out = folder + "/coupling-sync_samplers-2/1";
  std::vector<std::string> expected{
      "run",          "julia", "--duration", "2",       "--coupling=sync",
      "--samplers=2", "--out", out,          "--label", "coupling=sync samplers=2, run 1"};
  EXPECT_EQ(sweep.command({1, 1}), expected);
  fs::create_directories(out);
  expected.emplace_back("--overwrite");
  EXPECT_EQ(sweep.command({1, 1}), expected);
}

TEST_F(SweepManifest, TimesAreGuessedFromWhatIsKnown) {
  Manifest m = begin_manifest(small(), "1.0", "/here");
  EXPECT_EQ(expected_wall_s(m, 0, 20), 24);
  m.outcomes[{m.configurations[1].name, 1}] = done_in(30);
  EXPECT_EQ(expected_wall_s(m, 0, 20), 30) << "like the others";
  m.outcomes[{m.configurations[0].name, 1}] = done_in(22);
  EXPECT_EQ(expected_wall_s(m, 0, 20), 22);
  m.outcomes[{m.configurations[0].name, 2}] = {.attempts = 2, .wall_s = 1};
  EXPECT_EQ(expected_wall_s(m, 0, 20), 22) << "a failure tells nothing";
}

}  // namespace
}  // namespace telesplat::launcher
