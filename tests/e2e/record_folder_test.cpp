// The owner of a record's folder, and the files of a run that ends before its time.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

std::string small(const TemporaryFolder& folder) {
  write_terrain(folder / "terrain.ply", 20);
  return folder / "terrain.ply";
}

// A run of some frames into DIR/OUT.
std::vector<std::string> short_run(const TemporaryFolder& folder, const std::string& out,
                                   std::vector<std::string> more = {}) {
  std::vector<std::string> a{"run", folder / "terrain.ply", "--cache", folder / "cache", "--size", "160x100", "--out",
                             out,   "--sampler-threads",    "1",       "--frames",       "5"};
  a.insert(a.end(), more.begin(), more.end());
  return a;
}

bool has(const std::string& path) { return fs::exists(fs::symlink_status(path)); }

TEST(RecordFolder, ASecondRunIntoItIsRefusedUnlessItMayOverwrite) {
  const TemporaryFolder folder;
  small(folder);
  const std::string out = folder / "runs/one";
  Program first("telesplat", short_run(folder, out, {"--verify", "1", "--viewers", "2"}), folder / "first");
  ASSERT_EQ(first.wait(90), 0) << first.err();
  EXPECT_TRUE(has(out + "/quality.csv") && has(out + "/viewer-2/images") && has(out + "/images/frame-000000.png"));
  EXPECT_EQ(fs::read_symlink(folder / "runs/latest"), "one") << "relative, so that the folder can be moved";
  std::ofstream(out + "/notes.txt") << "mine";
  std::ofstream(out + "/images/drawing.png") << "mine";
  fs::create_symlink("/etc", out + "/elsewhere");
  const std::string summary = read_text(out + "/summary.json");

  Program refused("telesplat", short_run(folder, out), folder / "refused");
  EXPECT_EQ(refused.wait(30), 2);
  EXPECT_NE(refused.err().find(out + ": holds a record already"), std::string::npos) << refused.err();
  EXPECT_NE(refused.err().find("--overwrite"), std::string::npos) << refused.err();
  Program by_hand("telesplat-master", {"--bind", "tcp://127.0.0.1:*", "--out", out}, folder / "by-hand");
  EXPECT_EQ(by_hand.wait(30), 2) << by_hand.err();
  EXPECT_NE(by_hand.err().find(out + ": holds a record already"), std::string::npos) << by_hand.err();
  EXPECT_EQ(read_text(out + "/summary.json"), summary) << "a run that was refused changed nothing";

  Program again("telesplat", short_run(folder, out, {"--overwrite"}), folder / "again");
  ASSERT_EQ(again.wait(90), 0) << again.err();
  EXPECT_FALSE(has(out + "/quality.csv") || has(out + "/viewer-2")) << "of the run before";
  EXPECT_EQ(read_text(out + "/notes.txt"), "mine");
  EXPECT_EQ(read_text(out + "/images/drawing.png"), "mine");
  EXPECT_TRUE(has(out + "/elsewhere") && has("/etc/passwd"));
  EXPECT_NE(read_text(out + "/summary.json"), summary);
}

// Messages hold UTF-8, names of folders any bytes.
TEST(RecordFolder, APathThatIsNotUtf8RecordsAllTheSame) {
  const TemporaryFolder folder;
  small(folder);
  const std::string out = folder / "caf\xe9";
  Program run("telesplat", short_run(folder, out, {"--verify", "1", "--viewers", "2"}), folder / "run");
  ASSERT_EQ(run.wait(90), 0) << run.err();
  for (const char* file : {"/summary.json", "/frames.csv", "/quality.csv", "/images/frame-000000.png"})
    EXPECT_TRUE(has(out + file)) << file;
}

TEST(RecordFolder, APersonsFolderAndOneThatCannotBeMadeAreRefused) {
  const TemporaryFolder folder;
  small(folder);
  fs::create_directories(folder / "data/images");
  std::ofstream(folder / "data/crater.csv") << "mine";
  std::ofstream(folder / "data/images/holiday.png") << "mine";
  const auto refused = [&](const char* program, const std::vector<std::string>& arguments, std::string why = "") {
    Program run(program, arguments, folder / "run");
    EXPECT_EQ(run.wait(30), 2) << program;
    if (why.empty()) why = folder / "data" + ": is not empty and holds no run, but crater.csv, images";
    EXPECT_NE(run.err().find(why), std::string::npos) << program << ": " << run.err();
    EXPECT_EQ(std::distance(fs::recursive_directory_iterator(folder / "data"), {}), 3) << program;
  };
  refused("telesplat", short_run(folder, folder / "data", {}));
  refused("telesplat", short_run(folder, folder / "data", {"--overwrite"}));
  refused("telesplat-master", {"--bind", "tcp://127.0.0.1:*", "--out", folder / "data"});
  refused("telesplat-viewer", {"--master", "tcp://127.0.0.1:7", "--size", "64x64", "--out", folder / "data"});
  const std::string cannot = "/proc/no/such: cannot be made a run folder";
  refused("telesplat", short_run(folder, "/proc/no/such"), cannot);
  refused("telesplat-master", {"--bind", "tcp://127.0.0.1:*", "--out", "/proc/no/such"}, cannot);
}

TEST(Interrupted, ARunWithAnEndSaysSoAndIsComplete) {
  PipelineRun run({"--duration", "120", "--verify", "20"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  run.program().signal(SIGINT);
  EXPECT_EQ(run.program().wait(90), 130) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  EXPECT_NE(run.program().err().find("interrupted; the record is complete"), std::string::npos) << run.program().err();
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_GT(s["frames"], 0);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_TRUE(s["quality"].is_object()) << "what was displayed is verified";
  EXPECT_FALSE(has(run.out() + "/spool"));
  EXPECT_TRUE(has(run.out() + "/images/frame-000000.png"));
}

TEST(Interrupted, BeforeTheFirstFrameThereAreNoResults) {
  // The first view takes long.
  PipelineRun run({"--duration", "60", "--size", "4096x4096", "--sampling-size", "4096x4096"});
  ASSERT_FALSE(run.master().empty());
  run.program().signal(SIGINT);
  EXPECT_EQ(run.program().wait(60), 130) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  if (run.program().err().find("the record is complete") != std::string::npos) GTEST_SKIP() << "it was too quick";
  EXPECT_NE(run.program().err().find("interrupted before the first frame"), std::string::npos) << run.program().err();
  EXPECT_EQ(run.program().out().find("fps over"), std::string::npos) << "a table of nothing: " << run.program().out();
  EXPECT_FALSE(has(run.out())) << "an empty record";
}

TEST(Interrupted, AgainEndsAtOnce) {
  PipelineRun run({"--duration", "120", "--verify", "1", "--record-every", "1"});
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "frames") > 60; }));
  run.program().signal(SIGINT);
  run.program().signal(SIGINT);
  ASSERT_TRUE(wait_until(
      [&] {
        return run.program().err().find("picture ") != std::string::npos || run.program().wait(0) >= 0 ||
               run.program().err().find("verified") != std::string::npos;
      },
      10));
  run.program().signal(SIGINT);
  EXPECT_EQ(run.program().wait(20), 130) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  EXPECT_NE(run.program().err().find("interrupted"), std::string::npos) << run.program().err();
  EXPECT_FALSE(has(run.out() + "/spool"));
}

}  // namespace
}  // namespace telesplat::test
