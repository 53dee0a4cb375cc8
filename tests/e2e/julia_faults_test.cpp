// Samplers of a Julia set that die, leave and come in mid-run: every frame is completed, nothing is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

pid_t pid_of(const nlohmann::json& status, const std::string& name) {
  const auto p = process(status, name);
  return p.is_object() ? p["pid"].get<pid_t>() : 0;
}

double frames_completed(const nlohmann::json& status) { return status.value("frames_completed", 0.0); }

// Frames go on: `more` more are completed.
bool frames_go_on(PipelineRun& run, int more = 3) {
  const double before = frames_completed(run.status());
  return run.wait_status([&](const auto& s) { return frames_completed(s) >= before + more; });
}

// Whether each completed frame of the record has all rows of its picture, each once: without steering it shall.
void expect_whole_frames(PipelineRun& run) {
  const auto frame = run.column("tiles.csv", "frame"), y = run.column("tiles.csv", "y"),
             height = run.column("tiles.csv", "height"), step = run.column("tiles.csv", "step");
  ASSERT_FALSE(frame.empty());
  std::map<double, std::vector<int>> rows;
  for (size_t i = 0; i < frame.size(); ++i) {
    if (step[i] != 1) continue;
    auto& seen = rows[frame[i]];
    seen.resize(200);
    for (int row = int(y[i]); row < int(y[i] + height[i]); ++row) ++seen.at(size_t(row));
  }
  int whole = 0;
  for (const auto& [id, seen] : rows) {
    EXPECT_LE(*std::max_element(seen.begin(), seen.end()), 1) << "frame " << id << " has a row twice";
    whole += *std::min_element(seen.begin(), seen.end()) == 1;
  }
  EXPECT_GE(whole + 2, int(rows.size())) << "only what was in flight when the run ended may be incomplete";
}

TEST(JuliaFaults, ASamplerKilledInMidFrameLosesNothing) {
  PipelineRun run({"--duration", "0", "--steering", "off", "--samplers", "2"}, "julia");
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  // Stopped while it holds a lease, so that it dies in the middle of it.
  pid_t victim = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) { return (victim = pid_of(s, "sampler-2")) > 0; }));
  ::kill(victim, SIGSTOP);
  EXPECT_TRUE(run.wait_status([](const auto& s) {
    const auto p = process(s, "sampler-2");
    return s["leases_expired"] > 0 || s["leases_backup"] > 0 || (p.is_object() && p["leases"] > 0);
  }));
  ::kill(victim, SIGKILL);
  EXPECT_TRUE(frames_go_on(run));
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_NE(run.program().err().find("sampler-2 died"), std::string::npos);
  expect_whole_frames(run);
  EXPECT_TRUE(run.all_gone());
}

TEST(JuliaFaults, ASamplerToldToStopFinishesWhatItHolds) {
  PipelineRun run({"--duration", "0", "--steering", "off", "--samplers", "1"}, "julia");
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  Program guest("telesplat-sampler", {"--master", run.master(), "--name", "guest", "--threads", "1"},
                run.folder() / "guest");
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "guest", "tiles_sampled") > 0; })) << guest.err();
  const auto before = run.status();
  guest.signal(SIGTERM);
  EXPECT_EQ(guest.wait(20), 0) << guest.err();
  EXPECT_TRUE(run.wait_status([](const auto& s) { return process(s, "guest").is_null(); }));
  EXPECT_TRUE(frames_go_on(run));
  EXPECT_EQ(run.status()["leases_expired"], before["leases_expired"]);
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  expect_whole_frames(run);
  EXPECT_TRUE(run.all_gone());
}

}  // namespace
}  // namespace telesplat::test
