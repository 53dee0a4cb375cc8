// Processes that die in mid-run: what must go on goes on, what must end ends, nothing is left behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <thread>

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

// Stops a sampler, so that it cannot finish what it holds, and returns when it holds a lease or lost one. One that
// waits gets a lease with the next frame. One that was just done with a tile and had not asked for the next gets none:
// it goes on, and is stopped again.
void stop_with_a_lease(PipelineRun& run, const std::string& name, pid_t pid) {
  const auto holds = [&](const auto& s) {
    const auto p = process(s, name);
    return s["leases_expired"] > 0 || (p.is_object() && p["leases"] > 0);
  };
  for (int attempt = 0; attempt < 10; ++attempt) {
    ::kill(pid, SIGSTOP);
    std::this_thread::sleep_for(std::chrono::seconds(1));  // what it had finished is known to be done
    if (run.wait_status(holds, 3)) return;
    ::kill(pid, SIGCONT);
    std::this_thread::sleep_for(std::chrono::milliseconds(100 + 37 * attempt));
  }
  ADD_FAILURE() << name << " never held a lease";
}

TEST(Faults, ASamplerKilledInMidFrameCostsItsLeases) {
  PipelineRun run({"--duration", "0", "--samplers", "2"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  pid_t victim = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return (victim = pid_of(s, "sampler-2")) > 0; }));
  stop_with_a_lease(run, "sampler-2", victim);
  ::kill(victim, SIGKILL);
  // Another life takes its place, and frames go on.
  EXPECT_TRUE(
      run.wait_status([&](const auto& s) { return pid_of(s, "sampler-2") > 0 && pid_of(s, "sampler-2") != victim; }));
  double completed = -1;
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    if (completed < 0) completed = s["frames_completed"];
    return s["frames_completed"] > completed;
  }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto s = run.summary();
  EXPECT_GE(s["errors"]["leases_expired"], 1);
  EXPECT_GE(s["tiles_released"], 1);
  EXPECT_EQ(s["samplers"], 2);
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
  auto delays = run.column("frames.csv", "inter_frame_ms");
  ASSERT_FALSE(delays.empty());
  std::sort(delays.begin(), delays.end());
  // On a machine that has nothing else to do a second is an age; on a crowded one every frame may take long.
  EXPECT_LT(delays.back(), std::max(1000.0, 20 * delays[delays.size() / 2])) << "the display stood still";
  EXPECT_GT(run.summary()["points_cached"], 0);
  EXPECT_TRUE(run.all_gone());
}

// Views are planned by the packer: one that stands still in the middle of it keeps nobody waiting for long.
TEST(Faults, APackerThatStopsAnsweringAndDiesWhilePlanningCostsNoViews) {
  PipelineRun run({"--duration", "0", "--steering", "on"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  pid_t victim = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return (victim = pid_of(s, "packer")) > 0; }));
  ::kill(victim, SIGSTOP);
  // The next view's plan does not come, and its tiles go out whole.
  EXPECT_TRUE(run.wait_status([](const auto& s) { return s["frames_in_flight"] > 0; }));
  ::kill(victim, SIGKILL);
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    return pid_of(s, "packer") > 0 && pid_of(s, "packer") != victim && value(s, "packer", "points") > 0;
  }));
  const double updates = value(run.status(), "viewer-1", "updates");
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") > updates + 2; }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto s = run.summary();
  EXPECT_GT(s["plans"], 0);
  EXPECT_GT(s["rays_saved"], 0);
  EXPECT_TRUE(run.all_gone());
}

TEST(Faults, ASamplerKilledWithMaskedLeasesLosesNoRays) {
  PipelineRun run({"--duration", "0", "--samplers", "2", "--steering", "on"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  pid_t victim = 0;
  // By now views are planned, and leases have masks.
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    victim = pid_of(s, "sampler-2");
    return victim > 0 && value(s, "viewer-1", "updates") > 3;
  }));
  stop_with_a_lease(run, "sampler-2", victim);
  ::kill(victim, SIGKILL);
  double completed = -1;
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    if (completed < 0) completed = s["frames_completed"];
    return s["frames_completed"] > completed + 3 && pid_of(s, "sampler-2") > 0;
  }));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_GE(run.summary()["tiles_released"], 1);
  // Every planned ray of a view whose update is complete came back. One that a newer view overtook while its tile was
  // out with the dead sampler ends with that tile left out.
  std::map<double, double> planned, cast;
  const auto frames = run.column("plans.csv", "frame"), rays = run.column("plans.csv", "rays_cast");
  const auto of = run.column("tiles.csv", "frame"), tile_rays = run.column("tiles.csv", "rays");
  for (size_t i = 0; i < frames.size(); ++i) planned[frames[i]] = rays[i];
  for (size_t i = 0; i < of.size(); ++i) cast[of[i]] += tile_rays[i];
  size_t masked = 0;
  const auto updated = run.column("updates.csv", "frame"), left_out = run.column("updates.csv", "left_out");
  for (size_t i = 0; i < updated.size(); ++i) {
    const double frame = updated[i];
    if (left_out[i] > 0) {
      EXPECT_LE(cast[frame], planned[frame]) << "frame " << frame << ", left out " << left_out[i];
      continue;
    }
    EXPECT_EQ(cast[frame], planned[frame]) << "frame " << frame << " of update " << i << " of " << updated.size();
    masked += planned[frame] > 0;
  }
  EXPECT_GT(masked, 3u);
  EXPECT_TRUE(run.all_gone());
}

TEST(Faults, ADataServerKilledIsStartedAgain) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const pid_t victim = kill_process(run, "data");
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return pid_of(s, "data") > 0 && pid_of(s, "data") != victim; }));
  const double updates = value(run.status(), "viewer-1", "updates");
  EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") > updates; }));
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_EQ(run.summary()["primitives"], 20000);
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
