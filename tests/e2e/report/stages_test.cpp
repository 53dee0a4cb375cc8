// Where the time of view updates goes, for every kind of scene and coupling; and processes on another clock.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>

#include "common/metrics/stages.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

// Updates have rows; the stages of each add up to its latency, and each is at least -error_ms.
void expect_stages(const PipelineRun& run, double error_ms = 0) {
  const auto latency = run.column("stages.csv", "latency_ms"), request = run.column("stages.csv", "request");
  const auto updates = run.column("updates.csv", "request"), of_updates = run.column("updates.csv", "latency_ms");
  ASSERT_FALSE(latency.empty());
  std::map<double, double> expected;
  for (size_t i = 0; i < updates.size(); ++i) expected[updates[i]] = of_updates[i];
  for (size_t i = 0; i < request.size(); ++i) {
    ASSERT_TRUE(expected.contains(request[i]));
    EXPECT_EQ(latency[i], expected[request[i]]);
  }
  EXPECT_GE(request.size() + 2, updates.size()) << "a row for each update, but for those that a replay completed";
  std::vector<double> sum(latency.size());
  for (const auto& column : metrics::kStageColumns) {
    const auto ms = run.column("stages.csv", column.name);
    ASSERT_EQ(ms.size(), latency.size()) << column.name;
    for (size_t i = 0; i < ms.size(); ++i) {
      EXPECT_GE(ms[i], -error_ms - 1e-6) << column.name << " of request " << request[i];
      sum[i] += ms[i];
    }
  }
  for (size_t i = 0; i < sum.size(); ++i) EXPECT_NEAR(sum[i], latency[i], 1e-4) << "request " << request[i];
}

struct Scene {
  const char* name;
  const char* coupling;
};
class Stages : public testing::TestWithParam<Scene> {};

TEST_P(Stages, AddUpAndNoneIsNegative) {
  TemporaryFolder folder;
  const std::string name = GetParam().name;
  std::vector<std::string> flags{"--duration", "3", "--coupling", GetParam().coupling};
  std::string scene;
  if (name == "julia") scene = "julia";
  if (name == "volume") {
    write_volume(scene = folder / "balls.mha");
    flags.insert(flags.end(), {"--tf", "0:#000000:0, 255:#ffffff:0.2"});
  }
  PipelineRun run(flags, scene);
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  expect_stages(run);
  const auto s = run.summary();
  double shares = 0, worked = 0;
  for (const auto& [stage, figures] : s["latency_stages_ms"].items()) {
    shares += double(figures["share"]);
    if (stage == "sampling" || stage == "decoding") worked += double(figures["max"]);
  }
  EXPECT_NEAR(shares, 1, 0.01);
  EXPECT_GT(worked, 0);
  EXPECT_GT(s["display_latency_ms"]["median"], 0);
  EXPECT_EQ(s["clock"]["largest_error_ms"], 0) << "one machine, one clock";
}
INSTANTIATE_TEST_SUITE_P(Of, Stages, testing::Values(Scene{"julia", "async"}, Scene{"volume", "sync"}),
                         [](const auto& info) { return std::string(info.param.name) + "_" + info.param.coupling; });

// The trace has all that chrome://tracing and Perfetto need, and joins the tables. A mesh, loosely coupled.
TEST(Trace, IsValidAndTellsFramesTilesAndRequests) {
  PipelineRun run({"--duration", "3", "--samplers", "2", "--coupling", "loose"});
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  expect_stages(run);
  const auto trace = nlohmann::json::parse(read_text(run.out() + "/trace.json"), nullptr, false);
  ASSERT_TRUE(trace.is_array());
  std::map<int, std::string> processes;
  std::set<std::pair<int, int>> lanes;
  std::map<std::string, nlohmann::json> open;  // spans that have begun, by category, id and name
  std::map<std::string, int> spans;
  std::set<uint64_t> frames, requests;
  for (const auto& e : trace) {
    const std::string phase = e["ph"], name = e["name"];
    const int pid = e["pid"], tid = e["tid"];
    if (phase == "M") {
      if (name == "process_name") processes[pid] = e["args"]["name"];
      if (name == "thread_name") lanes.insert({pid, tid});
      continue;
    }
    EXPECT_TRUE(processes.contains(pid)) << "named before its first span: " << e;
    EXPECT_GE(e["ts"], 0) << e;
    const std::string key = phase == "X" ? "" : e["cat"].dump() + e["id"].dump() + name;
    if (phase == "X") {
      EXPECT_TRUE(lanes.contains({pid, tid})) << "its lane has a name: " << e;
      EXPECT_GE(e["dur"], 0);
      ++spans[name];
    } else if (phase == "b") {
      EXPECT_TRUE(open.emplace(key, e).second) << "ids are told apart: " << e;
      ++spans[name];
    } else {
      ASSERT_EQ(phase, "e") << e;
      ASSERT_TRUE(open.contains(key)) << "ends without a beginning: " << e;
      EXPECT_GE(double(e["ts"]), double(open[key]["ts"]));
      open.erase(key);
      continue;
    }
    if (e["args"].contains("frame")) frames.insert(uint64_t(e["args"]["frame"]));
    if (e["args"].contains("request")) requests.insert(uint64_t(e["args"]["request"]));
  }
  EXPECT_TRUE(open.empty()) << open.size() << " spans never end";
  for (const char* name : {"lease", "plan", "sample", "encode", "pack", "decode", "insert", "view update",
                           "display frame", "wait for update"})
    EXPECT_GT(spans[name], 0) << name;
  for (const char* name : {"master", "packer", "viewer-1", "sampler-1"}) {
    bool named = false;
    for (const auto& [pid, process] : processes) named = named || process == name;
    EXPECT_TRUE(named) << name;
  }
  for (const double frame : run.column("tiles.csv", "frame")) EXPECT_TRUE(frames.contains(uint64_t(frame))) << frame;
  for (const double r : run.column("updates.csv", "request")) EXPECT_TRUE(requests.contains(uint64_t(r))) << r;
}

// A sampler in a time namespace of its own: its clock is 5000 s ahead, as if it ran on another machine.
TEST(OtherClock, IsFollowedWithinWhatItSays) {
  if (std::system("unshare --time --monotonic 5000 true > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "unshare --time is not allowed here (it needs root and a kernel with time namespaces)";
  TemporaryFolder folder;
  PipelineRun run({"--duration", "0", "--samplers", "1", "--trajectory", "orbit"});
  ASSERT_TRUE(run.wait_showing());
  Program sampler(
      "/usr/bin/unshare",
      {"--time", "--monotonic", "5000", "--fork", "--kill-child", std::string(TELESPLAT_BIN) + "/telesplat-sampler",
       "--name", "elsewhere", "--master", run.master(), "--threads", "1"},
      folder / "sampler");
  ASSERT_TRUE(run.wait_status([](const auto& status) {
    return value(status, "elsewhere", "tiles_sampled") > 5 && value(status, "elsewhere", "clock_error_ms") > 0;
  })) << sampler.err();
  const auto status = run.status();
  const double error_ms = value(status, "elsewhere", "clock_error_ms");
  EXPECT_NEAR(value(status, "elsewhere", "clock_offset_ms"), -5e6, error_ms + 0.05);
  EXPECT_EQ(value(status, "sampler-1", "clock_error_ms"), 0) << "on the master's own clock";
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  // Its tiles line up with everyone's.
  expect_stages(run, 20);
  const auto leased = run.column("tiles.csv", "leased_s"), begin = run.column("tiles.csv", "sample_begin_s"),
             end = run.column("tiles.csv", "encode_end_s"), receive = run.column("tiles.csv", "receive_s");
  for (size_t i = 0; i < leased.size(); ++i) {
    EXPECT_GT(begin[i], leased[i] - 0.02);
    EXPECT_GT(receive[i], end[i] - 0.02);
  }
}

}  // namespace
}  // namespace telesplat::test
