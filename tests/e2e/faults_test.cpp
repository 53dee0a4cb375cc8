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

TEST(Faults, ASamplerKilledIsStartedAgain) {
  PipelineRun run({"--duration", "0", "--samplers", "2"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const pid_t victim = kill_process(run, "sampler-2");
  // Another life takes its place, and frames go on.
  EXPECT_TRUE(
      run.wait_status([&](const auto& s) { return pid_of(s, "sampler-2") > 0 && pid_of(s, "sampler-2") != victim; }));
  double completed = -1;
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    if (completed < 0) completed = s["frames_completed"];
    return s["frames_completed"] > completed;
  }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_EQ(run.summary()["samplers"], 2);
  EXPECT_NE(run.program().err().find("sampler-2 died"), std::string::npos);
  EXPECT_TRUE(run.all_gone());
}

TEST(Faults, APackerKilledIsStartedAgainAndViewersResynchronise) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  double frames = 0, updates = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return (updates = value(s, "viewer-1", "updates")) > 0; }));
  const pid_t victim = kill_process(run, "packer");
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    return pid_of(s, "packer") > 0 && pid_of(s, "packer") != victim && value(s, "packer", "points") > 0;
  }));
  const auto now = run.status();
  frames = value(now, "viewer-1", "frames"), updates = value(now, "viewer-1", "updates");
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "viewer-1", "frames") > frames && value(s, "viewer-1", "updates") > updates &&
           value(s, "viewer-1", "points") > 0;
  }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_GT(run.summary()["points_cached"], 0);
  EXPECT_TRUE(run.all_gone());
}

// The session goes on with another master at the same address, and so does its record.
TEST(Faults, AMasterKilledIsStartedAgainAndTheRecordGoesOn) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const pid_t victim = run.status()["session"].value("pid", pid_t{0});
  ASSERT_GT(victim, 0);
  const auto frames_so_far = [&] { return run.column("frames.csv", "frame").size(); };
  ASSERT_TRUE(wait_until([&] { return frames_so_far() > 0; }));
  const size_t before = frames_so_far();
  ::kill(victim, SIGKILL);
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return s["session"].value("pid", pid_t{0}) != victim; }))
      << run.program().err();
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return pid_of(s, "viewer-1") > 0 && value(s, "viewer-1", "updates") > 0 && pid_of(s, "sampler-1") > 0;
  }));
  EXPECT_TRUE(wait_until([&] { return frames_so_far() > before + 20; }));
  EXPECT_NE(run.program().err().find("master died"), std::string::npos);
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto summary = run.summary();
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
