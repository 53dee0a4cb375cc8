// A record outlives a disk that is full and a master that is killed, and says what it lacks.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

size_t count_of(const std::string& text, const std::string& what) {
  size_t n = 0;
  for (size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++n;
  return n;
}

/// Programs that are started meanwhile can make no file larger than `bytes`.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST(FullDisk, ARunGoesOnSaysItOnceAndEndsWithOne) {
  const TemporaryFolder folder;
  write_terrain(folder / "terrain.ply", 20);
  std::unique_ptr<Program> run;
  {
    const SmallDisk disk(100'000);
    run = std::make_unique<Program>(
        "telesplat",
        std::vector<std::string>{"run", folder / "terrain.ply", "--no-cache", "--size", "480x320", "--out",
                                 folder / "out", "--sampler-threads", "1", "--duration", ordinary_or_slow("6", "40"),
                                 "--record-every", "1", "--record-depth"},
        folder / "run");
  }
  EXPECT_EQ(run->wait(patient(90)), 1) << run->err();
  // The message names the missing file and the system's reason; a full disk has another word at the same place.
  for (const char* told : {"out: not all of the record could be written: ", "trace.json: File too large\n",
                           " pictures, points.events: File too large\n"})
    EXPECT_NE(run->err().find(told), std::string::npos) << told << ": " << run->err();
  EXPECT_EQ(run->out().find("images/"), std::string::npos) << "there is no picture: " << run->out();
  const auto summary = nlohmann::json::parse(read_text(folder / "out/summary.json"), nullptr, false);
  ASSERT_TRUE(summary.is_object()) << "the disk had no room for it: " << run->err();
  EXPECT_GE(summary["errors"]["record_failed"], 2) << summary["errors"];
  EXPECT_GT(summary["duration_s"], 5) << "the session lasted as long as it was to";
  const std::string viewer = read_text(folder / "out/logs/viewer-1.log"),
                    master = read_text(folder / "out/logs/master.log");
  EXPECT_EQ(count_of(viewer, "frames cannot be written"), 1u) << "a line, not one a frame: " << viewer;
  EXPECT_EQ(count_of(master, "trace.json: cannot be written"), 1u) << master;
  uint64_t lost = 0;
  ASSERT_TRUE(summary["errors"]["record_lost"].is_object()) << summary["errors"];
  for (const auto& [file, rows] : summary["errors"]["record_lost"].items()) lost += rows.get<uint64_t>();
  EXPECT_GT(lost, 0u);
  for (const char* file : {"frames.csv", "updates.csv", "tiles.csv"})
    EXPECT_TRUE(read_text(folder / ("out/" + std::string(file))).ends_with('\n')) << file << ": whole rows alone";
}

/// A session by hand, whose master can be killed and started again.
class SeveralLives : public testing::Test {
 protected:
  Program& start(const std::string& role, std::vector<std::string> arguments) {
    if (role != "master") arguments.insert(arguments.end(), {"--master", master_});
    services_.push_back(
        std::make_unique<Program>("telesplat-" + role, arguments, folder_ / (role + std::to_string(services_.size()))));
    return *services_.back();
  }
  Program& start_master(const std::string& bind) {
    Program& master = start("master", {"--bind", bind, "--out", out(), "--continue"});
    master_ = address_of(master);
    return master;
  }
  std::string out() const { return folder_ / "runs/lives"; }
  std::string text(const std::string& file) const { return read_text(out() + "/" + file); }

  TemporaryFolder folder_;
  std::string master_;
  std::vector<std::unique_ptr<Program>> services_;
};

TEST_F(SeveralLives, AMasterThatWasKilledGoesOnWithItsRecord) {
  write_terrain(folder_ / "hill.ply", 40);
  Program& first = start_master("tcp://127.0.0.1:*");
  ASSERT_FALSE(master_.empty());
  start("data", {folder_ / "hill.ply", "--cache", folder_ / "cache"});
  start("packer", {});
  start("sampler", {"--name", "sampler-1", "--threads", "1"});
  Program& viewer = start("viewer", {"--size", "160x100", "--duration", "0", "--target-fps", "20"});
  ASSERT_TRUE(wait_until([&] { return count_of(text("frames.csv"), "\n") > 40; })) << viewer.err();
  first.signal(SIGKILL);
  ASSERT_EQ(first.wait(10), 128 + SIGKILL);
  const std::string frames = text("frames.csv"), tiles = text("tiles.csv"), id = text("run.id");
  EXPECT_FALSE(fs::exists(out() + "/summary.json"));
  EXPECT_TRUE(frames.ends_with('\n') && tiles.ends_with('\n')) << "whole rows alone";

  Program& second = start_master(master_);
  ASSERT_TRUE(wait_until([&] { return count_of(text("frames.csv"), "\n") > count_of(frames, "\n") + 40; }))
      << second.err();
  Program stop("telesplat", {"ctl", "stop", "--master", master_}, folder_ / "stop");
  EXPECT_EQ(stop.wait(), 0) << stop.err();
  EXPECT_EQ(viewer.wait(60), 0) << viewer.err();
  EXPECT_EQ(second.wait(20), 0) << second.err();

  EXPECT_EQ(text("run.id"), id) << "viewers that record into the folder know it";
  EXPECT_TRUE(text("frames.csv").starts_with(frames)) << "nothing that was written is gone";
  EXPECT_TRUE(text("tiles.csv").starts_with(tiles));
  EXPECT_EQ(count_of(text("frames.csv"), "viewer,"), 1u) << "one header";
  const auto summary = nlohmann::json::parse(text("summary.json"), nullptr, false);
  ASSERT_TRUE(summary.is_object());
  EXPECT_EQ(summary["lives"], 2);
  EXPECT_EQ(summary["frames"], count_of(text("frames.csv"), "\n") - 1) << "of both";
  EXPECT_EQ(summary["errors"]["record_failed"], 0);
  EXPECT_EQ(count_of(text("lives.csv"), "\n"), 3u);
  EXPECT_TRUE(nlohmann::json::accept(text("trace.json")));
  EXPECT_TRUE(fs::exists(out() + "/images/frame-000000.png")) << "its viewer went on in the folder";
  Program inspect("telesplat", {"inspect", out()}, folder_ / "inspect");
  EXPECT_EQ(inspect.wait(60), 0) << inspect.err();
}

TEST_F(SeveralLives, OneThatWasStoppedGoesOnTooAndNothingElseIsTakenForARecord) {
  Program& first = start_master("tcp://127.0.0.1:*");
  first.signal(SIGTERM);
  EXPECT_EQ(first.wait(20), 0) << first.err();
  EXPECT_TRUE(fs::exists(out() + "/summary.json"));
  Program& second = start_master("tcp://127.0.0.1:*");
  EXPECT_FALSE(fs::exists(out() + "/summary.json")) << "it is not all of the record any more";
  second.signal(SIGTERM);
  EXPECT_EQ(second.wait(20), 0) << second.err();
  EXPECT_EQ(nlohmann::json::parse(text("summary.json"), nullptr, false)["lives"], 2);
  fs::create_directories(folder_ / "mine");
  std::ofstream(folder_ / "mine/frames.csv") << "mine\n";
  Program refused("telesplat-master", {"--bind", "tcp://127.0.0.1:*", "--continue", "--out", folder_ / "mine"},
                  folder_ / "refused");
  EXPECT_EQ(refused.wait(20), 2) << refused.err();
  Program both("telesplat-master", {"--bind", "tcp://127.0.0.1:*", "--continue", "--overwrite", "--out", out()},
               folder_ / "both");
  EXPECT_EQ(both.wait(20), 2) << both.err();
}

}  // namespace
}  // namespace telesplat::test
