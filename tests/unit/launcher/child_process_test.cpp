// Children of the launcher: their output, their ends.
#include <gtest/gtest.h>

#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "common/core/clock.h"
#include "tools/telesplat/run/child_process.h"
#include "tools/telesplat/run/process_group.h"

namespace telesplat::launcher {
namespace {

class Child : public ::testing::Test {
 protected:
  Child() {
    std::string pattern = (std::filesystem::temp_directory_path() / "telesplat-child-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~Child() override { std::filesystem::remove_all(folder); }
  ChildProcess shell(const std::string& script) {
    auto child = ChildProcess::start("child", "/bin/sh", {"-c", script}, folder + "/log", 0);
    EXPECT_TRUE(child);
    return std::move(*child);
  }
  // Reads until it has ended, 20 s at most.
  static std::vector<std::string> all_lines(ChildProcess& child) {
    std::vector<std::string> lines;
    bool ended = false;
    for (const double until = monotonic_s() + 20; !ended && monotonic_s() < until;) {
      ended = child.ended();
      for (auto& line : child.read_lines()) lines.push_back(std::move(line));
    }
    EXPECT_TRUE(ended);
    return lines;
  }
  std::string log() const {
    std::ifstream in(folder + "/log");
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string folder;
};

TEST_F(Child, LinesAndExitCodesComeBack) {
  auto child = shell("echo one; echo two; echo trouble >&2; printf 'no end'; exit 3");
  EXPECT_EQ(all_lines(child), (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(child.exit_code(), 3);
  EXPECT_EQ(log(), "trouble\n");
  EXPECT_EQ(std::filesystem::status(folder + "/log").permissions(), std::filesystem::perms(0600));
  EXPECT_EQ(child.name(), "child");
}

// The child goes on writing where the log begins anew; the former content is kept once.
TEST_F(Child, ALogBeginsAnewBeforeItIsTooLarge) {
  auto child = ChildProcess::start("child", "/bin/sh", {"-c", "echo first >&2; echo there; read go; echo second >&2"},
                                   folder + "/child.log", 0, true);
  ASSERT_TRUE(child);
  const auto text = [&](const char* name) {
    std::ifstream in(folder + "/" + name);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  std::ofstream(folder + "/child.before.log") << "older";
  for (const double until = monotonic_s() + 20; child->read_lines().empty() && monotonic_s() < until;) usleep(1000);
  limit_log(folder + "/child.log", 6);
  EXPECT_EQ(text("child.log"), "first\n");
  limit_log(folder + "/child.log", 5);
  child->tell("go");
  all_lines(*child);
  EXPECT_EQ(text("child.before.log"), "first\n");
  EXPECT_EQ(text("child.log"), "second\n");
}

// A link's target, which another user may have chosen, is neither emptied nor overwritten.
TEST_F(Child, ALogThatIsALinkIsLeftAlone) {
  std::ofstream(folder + "/others") << "of another";
  std::filesystem::create_symlink("others", folder + "/child.log");
  limit_log(folder + "/child.log", 5);
  EXPECT_EQ(std::filesystem::file_size(folder + "/others"), 10u);
  std::filesystem::remove(folder + "/child.log");
  std::ofstream(folder + "/child.log") << "a log";
  std::filesystem::create_symlink("others", folder + "/child.before.log");
  limit_log(folder + "/child.log", 4);
  EXPECT_EQ(std::filesystem::file_size(folder + "/others"), 10u);
  EXPECT_EQ(std::filesystem::file_size(folder + "/child.before.log"), 5u);
  EXPECT_EQ(std::filesystem::file_size(folder + "/child.log"), 0u);
}

TEST_F(Child, MuchOutputDoesNotBlockIt) {
  auto child =
      shell("i=0; while [ $i -lt 5000 ]; do echo 'a line of some length, five thousand times'; i=$((i+1)); done");
  EXPECT_EQ(all_lines(child).size(), 5000u);
  EXPECT_EQ(child.exit_code(), 0);
}

TEST_F(Child, AnEndlessLineIsCutShort) {
  auto child = shell("head -c 100000 /dev/zero | tr '\\0' x; echo; echo end");
  const auto lines = all_lines(child);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_LE(lines[0].size(), 4096u);
  EXPECT_EQ(lines[1], "end");
}

TEST_F(Child, SignalsShowInTheExitCode) {
  auto child = shell("exec sleep 60");
  EXPECT_FALSE(child.ended());
  child.signal(SIGKILL);
  all_lines(child);
  EXPECT_EQ(child.exit_code(), 128 + SIGKILL);
  child.signal(SIGTERM);  // the process is gone: no effect
}

TEST_F(Child, FinishWaitsThenAsksThenKills) {
  auto willing = shell("trap 'exit 5' TERM; echo ready; while :; do sleep 0.05; done");
  std::vector<std::string> lines;
  for (const double until = monotonic_s() + 20; lines.empty() && monotonic_s() < until;) lines = willing.read_lines();
  ASSERT_EQ(lines.size(), 1u);
  willing.finish(0.2);
  ASSERT_TRUE(willing.ended());
  auto stubborn = shell("trap '' TERM; echo ready; while :; do sleep 0.05; done");
  lines.clear();
  for (const double until = monotonic_s() + 20; lines.empty() && monotonic_s() < until;) lines = stubborn.read_lines();
  stubborn.finish(0.2);
  ASSERT_TRUE(stubborn.ended());
  EXPECT_EQ(stubborn.exit_code(), 128 + SIGKILL);
}

TEST_F(Child, GoesWithItsObject) {
  pid_t pid = 0;
  {
    auto child = shell("exec sleep 60");
    pid = child.pid();
    auto moved = std::move(child);
    EXPECT_EQ(moved.pid(), pid);
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST_F(Child, AProgramThatIsNotThereIsToldInItsLog) {
  auto child = ChildProcess::start("nothing", folder + "/nothing", {}, folder + "/log", 0);
  ASSERT_TRUE(child);
  all_lines(*child);
  EXPECT_EQ(child->exit_code(), 127);
  EXPECT_NE(log().find(folder + "/nothing"), std::string::npos);
  EXPECT_FALSE(ChildProcess::start("child", "/bin/true", {}, folder + "/no/such/folder/log", 0));
}

TEST_F(Child, HasAProcessGroupOfItsOwn) {
  auto child = shell("exec sleep 60");
  // The child makes its group itself, before it becomes its program.
  for (const double until = monotonic_s() + 20; getpgid(child.pid()) != child.pid() && monotonic_s() < until;) {
  }
  EXPECT_EQ(getpgid(child.pid()), child.pid());
}

}  // namespace
}  // namespace telesplat::launcher
