// Messages at a run's end: viewers that showed nothing, a machine that was too busy.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tools/telesplat/run/after_run.h"
#include "tools/telesplat/run/live_figures.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class Unseen : public ::testing::Test {
 protected:
  Unseen() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-unseen-XXXXXX").string();
    options_.out = mkdtemp(pattern.data());
  }
  ~Unseen() override { fs::remove_all(options_.out); }

  // Returns the exit code; said_ has the messages.
  int code_of(const std::string& by_viewer, bool stopped = false) {
    std::ofstream(options_.out + "/summary.json") << "{\"by_viewer\": " << by_viewer << "}";
    testing::internal::CaptureStderr();
    const int code = AfterRun(options_, nullptr, no_movie_, progress_).tell_unseen(stopped);
    said_ = testing::internal::GetCapturedStderr();
    return code;
  }

  RunOptions options_;
  std::optional<MoviePlan> no_movie_;
  tools::ProgressLine progress_;
  std::string said_;
};

TEST_F(Unseen, ARunThatShowedNothingFails) {
  constexpr const char* kDark = R"({"viewer-1": {"frames_of_views": 0}, "viewer-2": {"frames_of_views": 0}})";
  EXPECT_EQ(code_of(kDark), 1);
  EXPECT_NE(said_.find("no frame shows the data"), std::string::npos) << said_;
  EXPECT_EQ(code_of(kDark, true), 0) << "a person stopped it";
  EXPECT_FALSE(said_.empty());
}

TEST_F(Unseen, ViewersThatShowedNothingAreNamed) {
  EXPECT_EQ(code_of(R"({"viewer-1": {"frames_of_views": 9}, "viewer-2": {"frames_of_views": 0}})"), 0);
  EXPECT_NE(said_.find("1 of 2 viewers never showed a complete view: viewer-2"), std::string::npos) << said_;
  EXPECT_EQ(code_of(R"({"viewer-1": {"frames_of_views": 9}})"), 0);
  EXPECT_EQ(said_, "");
  EXPECT_EQ(code_of(R"({"viewer-1": {"frames": 9}})"), 0) << "a master of another version";
  EXPECT_EQ(said_, "");
}

TEST(ProcessorWait, IsTheShareOfTimeThatTheKernelCounts) {
  ProcessorWait wait;
  EXPECT_EQ(wait.share(), 0);
  wait.look(getpid(), 10);
  EXPECT_EQ(wait.share(), 0) << "one look tells nothing";
  wait.look(getpid(), 10 + 1e6);
  EXPECT_GE(wait.share(), 0);
  EXPECT_LT(wait.share(), 1e-3) << "seconds of 12 days";
  ProcessorWait none;
  none.look(0, 1), none.look(0, 2);  // there is no process 0
  EXPECT_EQ(none.share(), 0);
}

}  // namespace
}  // namespace telesplat::launcher
