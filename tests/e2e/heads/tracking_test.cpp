// Heads that other programs move: telesplat-lab pose-replay and silent publishers, real processes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

// A head that sways before the data, 100 poses a second for ten seconds.
void write_swaying(const std::string& path) {
  std::ofstream out(path);
  out << "t_s,px,py,pz,qw,qx,qy,qz\n";
  for (int i = 0; i <= 1000; ++i) {
    const double t_s = i * 0.01, x = 0.15 * std::sin(2 * t_s);
    out << t_s << ',' << x << ",0.4,1,1,0,0,0\n";
  }
}

class Replay {
 public:
  Replay(const TemporaryFolder& folder, std::vector<std::string> arguments) : program_(make(folder, arguments)) {
    EXPECT_TRUE(wait_until([&] { return program_->out().find('\n') != std::string::npos; })) << program_->err();
    const std::string out = program_->out();
    address_ = out.substr(9, out.find('\n') - 9);  // "poses at ..."
  }
  const std::string& address() const { return address_; }
  Program& program() { return *program_; }

 private:
  static std::unique_ptr<Program> make(const TemporaryFolder& folder, std::vector<std::string> arguments) {
    write_swaying(folder / "swaying.csv");
    arguments.insert(arguments.begin(), {"pose-replay", folder / "swaying.csv", "--bind", "tcp://127.0.0.1:*"});
    return std::make_unique<Program>("telesplat-lab", std::move(arguments), folder / "replay");
  }
  std::unique_ptr<Program> program_;
  std::string address_;
};

double most(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }
double least(const std::vector<double>& values) { return *std::min_element(values.begin(), values.end()); }

TEST(Tracking, AReplayedTrackerMovesTheHead) {
  TemporaryFolder folder;
  Replay replay(folder, {"--loop", "--jitter", "5", "--loss", "0.1"});
  PipelineRun run({"--poses", replay.address(), "--duration", "4"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  EXPECT_NE((run.program().err() + run.program().out()).find("poses move the head"), std::string::npos)
      << run.program().err();
  const auto x = run.column("frames.csv", "px");
  ASSERT_GT(x.size(), 20u);
  EXPECT_GT(most(x), 0.1);
  EXPECT_LT(least(x), -0.1);
  for (const double y : run.column("frames.csv", "py")) ASSERT_NEAR(y, 0.4, 0.02);
  const auto summary = run.summary();
  EXPECT_EQ(summary["predicted_by"], "kalman");
  ASSERT_TRUE(summary["prediction"].is_object()) << summary.dump(2);
  EXPECT_GT(summary["prediction"]["count"], 5);
  EXPECT_GT(summary["prediction"]["horizon_ms"], 0);
  ASSERT_TRUE(summary["pose_prediction"].is_object());
  EXPECT_LT(summary["pose_prediction"]["over_none_mm"], 0.8);
  replay.program().signal(SIGINT);
  EXPECT_EQ(replay.program().wait(), 0);
  EXPECT_NE(replay.program().err().find("lost on purpose"), std::string::npos);
  for (const auto& [arguments, named] :
       {std::pair<std::vector<std::string>, std::string>{{"pose-replay", folder / "nothing.csv"}, "nothing.csv"},
        {{"pose-replay", folder / "swaying.csv", "--bind", "tcp://0.0.0.0:*"}, "--insecure"}}) {
    Program refused("telesplat-lab", arguments, folder / "refused");
    EXPECT_EQ(refused.wait(), 2);
    EXPECT_NE(refused.err().find(named), std::string::npos) << refused.err();
  }
}

TEST(Tracking, TheDisplayGoesOnWithoutAPublisherAndAfterIt) {
  TemporaryFolder folder;
  // No process publishes there.
  PipelineRun alone({"--poses", "tcp://127.0.0.1:9", "--duration", "1"});
  ASSERT_EQ(alone.program().wait(), 0) << alone.program().err();
  EXPECT_GT(alone.column("frames.csv", "px").size(), 10u);

  auto replay = std::make_unique<Replay>(folder, std::vector<std::string>{"--loop"});
  PipelineRun run({"--poses", replay->address(), "--duration", "5"});
  ASSERT_TRUE(run.wait_showing());
  replay.reset();  // killed
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const std::string said = run.program().err() + run.program().out();
  EXPECT_NE(said.find("no poses for 0.5 s: the head stays where it was"), std::string::npos) << said;
  const auto x = run.column("frames.csv", "px");
  ASSERT_GT(x.size(), 40u);
  EXPECT_EQ(x[x.size() - 1], x[x.size() - 10]);
}

}  // namespace
}  // namespace telesplat::test
