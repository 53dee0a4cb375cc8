// Processes that die in mid-run: what must go on goes on, what must end ends, nothing is left behind.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

pid_t pid_of(const nlohmann::json& status, const std::string& name) {
  const auto p = process(status, name);
  return p.is_object() ? p["pid"].get<pid_t>() : 0;
}

// Kills a process and returns its pid.
pid_t kill_process(PipelineRun& run, const std::string& name) {
  pid_t pid = 0;
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return (pid = pid_of(s, name)) > 0; })) << name;
  if (pid > 0) ::kill(pid, SIGKILL);
  return pid;
}

// One after the other: another life takes the place of each, and frames go on.
TEST(Faults, SamplerPackerAndMasterThatAreKilledAreStartedAgain) {
  PipelineRun run({"--duration", "0", "--samplers", "2"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const pid_t sampler = kill_process(run, "sampler-2");
  EXPECT_TRUE(
      run.wait_status([&](const auto& s) { return pid_of(s, "sampler-2") > 0 && pid_of(s, "sampler-2") != sampler; }));
  double completed = -1;
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    if (completed < 0) completed = s["frames_completed"];
    return s["frames_completed"] > completed;
  }));

  const pid_t packer = kill_process(run, "packer");
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    return pid_of(s, "packer") > 0 && pid_of(s, "packer") != packer && value(s, "packer", "points") > 0;
  }));
  const auto now = run.status();
  const double frames = value(now, "viewer-1", "frames"), updates = value(now, "viewer-1", "updates");
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "viewer-1", "frames") > frames && value(s, "viewer-1", "updates") > updates &&
           value(s, "viewer-1", "points") > 0;
  }));

  // The session goes on with another master at the same address, and so does its record.
  const pid_t master = run.status()["session"].value("pid", pid_t{0});
  ASSERT_GT(master, 0);
  const auto frames_so_far = [&] { return run.column("frames.csv", "frame").size(); };
  ASSERT_TRUE(wait_until([&] { return frames_so_far() > 0; }));
  const size_t before = frames_so_far();
  ::kill(master, SIGKILL);
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return s["session"].value("pid", pid_t{0}) != master; }))
      << run.program().err();
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return pid_of(s, "viewer-1") > 0 && value(s, "viewer-1", "updates") > 0 && pid_of(s, "sampler-1") > 0;
  }));
  EXPECT_TRUE(wait_until([&] { return frames_so_far() > before + 20; }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  for (const char* died : {"sampler-2 died", "packer died", "master died"})
    EXPECT_NE(run.program().err().find(died), std::string::npos) << run.program().err();
  const auto summary = run.summary();
  EXPECT_EQ(summary["samplers"], 2);
  EXPECT_GT(summary["points_cached"], 0);
  EXPECT_GT(summary["frames"], before) << "both masters' frames";
  EXPECT_TRUE(run.all_gone());
}

TEST(Faults, ALauncherKilledTakesItsChildrenAlong) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  run.program().signal(SIGKILL);
  EXPECT_EQ(run.program().wait(), 128 + SIGKILL);
  EXPECT_TRUE(run.all_gone(30));
}

}  // namespace
}  // namespace telesplat::test
