// `telesplat tune` with real runs: a scene file that `telesplat run` takes; refusals before anything starts.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class Tunes : public ::testing::Test {
 protected:
  Tunes() { write_terrain(folder / "terrain.ply", 20); }

  std::vector<std::string> words(std::vector<std::string> own, std::vector<std::string> flags = {}) const {
    std::vector<std::string> out{"tune",   folder / "terrain.ply", "--out", folder / "tuned.toml",
                                 "--runs", folder / "runs"};
    out.insert(out.end(), own.begin(), own.end());
    out.insert(out.end(), {"--", "--cache", folder / "cache", "--size", "160x100"});
    out.insert(out.end(), flags.begin(), flags.end());
    return out;
  }

  TemporaryFolder folder;
};

TEST_F(Tunes, ASceneFileIsWrittenThatRunTakes) {
  // Samplers alone are free: few settings, and each run a second.
  Program tune("telesplat",
               words({"--quick", "--seconds", "1"}, {"--tile-size", "64", "--sampling-size", "160x100",
                                                     "--octree-depth", "5", "--update-rate=20", "--room-size", "0.7"}),
               folder / "tune");
  ASSERT_EQ(tune.wait(120), 0) << tune.err();
  EXPECT_NE(tune.out().find("defaults"), std::string::npos) << tune.out();
  EXPECT_NE(tune.out().find("latency ms: predicted"), std::string::npos) << tune.out();
  const std::string text = read_text(folder / "tuned.toml");
  EXPECT_NE(text.find("# Costs, measured:"), std::string::npos) << text;
  EXPECT_NE(text.find("ray: "), std::string::npos) << text;
  EXPECT_NE(text.find("room_size = \"0.7\""), std::string::npos) << text;
  EXPECT_NE(text.find("tile_size = \"64\""), std::string::npos) << "what was given stays";
  EXPECT_TRUE(fs::exists(folder / "runs/costs-1/summary.json"));

  Program run("telesplat", {"run", folder / "tuned.toml", "--frames", "5", "--out", folder / "run"}, folder / "run-it");
  EXPECT_EQ(run.wait(60), 0) << run.err();
  EXPECT_NE(read_text(folder / "run/summary.json").find("160"), std::string::npos);
}

TEST_F(Tunes, CtrlCEndsInOrderAndWritesNothing) {
  Program tune("telesplat", words({"--seconds", "30"}), folder / "tune");
  ASSERT_TRUE(wait_until([&] { return fs::exists(folder / "runs/costs-1/frames.csv") || tune.wait(0) >= 0; }, 60))
      << tune.err();
  tune.signal(SIGINT);
  EXPECT_EQ(tune.wait(60), 130) << tune.err();
  EXPECT_NE(tune.err().find("interrupted; no scene file was written"), std::string::npos) << tune.err();
  EXPECT_FALSE(fs::exists(folder / "tuned.toml"));
}

TEST_F(Tunes, NothingIsStartedBeforeAllIsChecked) {
  for (const auto& [flags, complaint] :
       {std::pair<std::vector<std::string>, std::string>{{"--samplers", "0"}, "--samplers 0: "},
        {{"--out", "x"}, "--out: is not for"},
        {{"--link", "20mbit"}, "--link: stands in front of --"},
        {{"--iso", "3"}, "--iso"},
        {{"--samplers=1", "--tile-size=64", "--sampling-size=80x50", "--octree-depth=5", "--update-rate=5"},
         "nothing is left to tune"}}) {
    Program tune("telesplat", words({}, flags), folder / "wrong");
    EXPECT_EQ(tune.wait(30), 2) << tune.err();
    EXPECT_NE(tune.err().find(complaint), std::string::npos) << tune.err();
  }
  Program link("telesplat", words({"--link", "50furlongs"}), folder / "link");
  EXPECT_EQ(link.wait(30), 2) << link.err();
  std::ofstream(folder / "tuned.toml") << "mine\n";
  Program there("telesplat", words({}), folder / "there");
  EXPECT_EQ(there.wait(30), 2);
  EXPECT_NE(there.err().find("is there already; --overwrite replaces it"), std::string::npos) << there.err();
  fs::remove(folder / "tuned.toml");
  Program dry("telesplat", words({"--dry-run", "--link", "50ms:100mbit"}), folder / "dry");
  EXPECT_EQ(dry.wait(30), 0) << dry.err();
  EXPECT_NE(dry.out().find("--link=50ms:100mbit"), std::string::npos) << dry.out();
  EXPECT_NE(dry.out().find("settings are predicted"), std::string::npos) << dry.out();
  EXPECT_FALSE(fs::exists(folder / "runs"));
}

}  // namespace
}  // namespace telesplat::test
