// A record that a new master continues after the old one was killed.
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "common/metrics/recorder.h"
#include "common/metrics/run_folder.h"
#include "tests/unit/metrics/record_fixture.h"

namespace telesplat::metrics {
namespace {

using nlohmann::json;

class Lives : public Record {
 protected:
  static constexpr Beginning kBegin{100, 1'700'000'000'000'000'000};
  std::string run = folder + "/lives";

  std::string text(const std::string& name) const {
    std::ifstream in(run + "/" + name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void append(const std::string& name, const std::string& text) const {
    std::ofstream(run + "/" + name, std::ios::app) << text;
  }

  void measure(RunRecord& r, double begin_s, uint64_t frame) {
    ASSERT_TRUE(r.add_rows(
        viewer,
        {{5}, "frames", {"t_s", "inter_frame_ms", "begin_s"}, {begin_s, 0, begin_s, begin_s + 1, 20, begin_s + 1}}));
    ASSERT_TRUE(r.add_rows(viewer, {{5}, "updates", {"latency_ms"}, {200}}));
    PlanRow plan;
    plan.asked.frame = {frame}, plan.asked.camera.width = 100, plan.asked.camera.height = 10;
    plan.outcome = PlanRow::Outcome::kTiles;
    plan.asked_s = begin_s, plan.planned_s = begin_s + 0.01;
    r.add_plan("viewer-1", plan);
    auto done = tile(frame, 0, begin_s);
    done.moments.leased_s = begin_s - 0.01;
    done.rays = 40;
    r.add_tile("sampler, 1", done);
    r.add_epoch({1}, begin_s, {{"c.x", 0.5}}, {{"transfer", "a,b"}});
    ASSERT_TRUE(r.add_rows(viewer, {{5}, "spans", {"sample"}, {0, begin_s, begin_s + 1, 0, 7, -1, -1}}));
  }
  /// A master that is killed: rows that it still holds are lost.
  void live_and_be_killed(double begin_s) {
    const pid_t pid = fork();
    if (pid == 0) {
      auto r = RunRecord::open(run, kBegin);
      if (!r) _exit(1);
      measure(**r, begin_s, 1);
      _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(pid, &status, 0), pid);
    ASSERT_EQ(status, 0);
  }
};

TEST_F(Lives, AnotherMasterGoesOnBehindTheWholeRows) {
  live_and_be_killed(101);
  const std::string frames = text("frames.csv"), epochs = text("epochs.csv");
  ASSERT_FALSE(frames.empty());
  append("frames.csv", "viewer-1,3.5");  // it was killed in mid-row
  append("tiles.csv", "1,2");
  append("trace.json", ",\n{\"ph\":\"X\",\"na");
  const json summary = [&] {
    auto r = RunRecord::open(run, {100 + 60, kBegin.unix_ns + 60'000'000'000}, {.goes_on = true});
    EXPECT_TRUE(r.ok()) << r.error().text;
    EXPECT_EQ((*r)->begin().monotonic_s, 100) << "times go on";
    measure(**r, 161, 1);
    EXPECT_TRUE((*r)->finish({viewer}, {{"leases_expired", 1}}));
    return json::parse(text("summary.json"));
  }();
  EXPECT_TRUE(text("frames.csv").starts_with(frames));
  EXPECT_EQ(text("frames.csv"),
            frames + "viewer-1,161.000000000,0,61.000000000\nviewer-1,162.000000000,20,62.000000000\n");
  EXPECT_EQ(text("epochs.csv"), epochs + "1,61.000000000,0.5,\"a,b\"\n");
  EXPECT_EQ(summary["lives"], 2);
  EXPECT_EQ(summary["frames"], 4);
  EXPECT_EQ(summary["updates"], 2);
  EXPECT_EQ(summary["epochs"], 2);
  EXPECT_EQ(summary["plans"], 2);
  EXPECT_EQ(summary["bytes_sent"], 1000);
  EXPECT_EQ(summary["rays_cast"], 80);
  EXPECT_EQ(summary["rays_full"], 2000);
  EXPECT_EQ(summary["sampling_ms"]["max"], 12) << "frame 1 of one master is not that of the other";
  EXPECT_EQ(summary["errors"]["record_failed"], 0);
  const json trace = json::parse(text("trace.json"), nullptr, false);
  ASSERT_TRUE(trace.is_array()) << text("trace.json");
  std::map<std::string, int> phases;
  std::set<int> processes;
  for (const auto& event : trace) ++phases[event["ph"]], processes.insert(int(event["pid"]));
  EXPECT_EQ(phases["X"], 2);
  EXPECT_EQ(processes.size(), 4u) << "a viewer and a master of each life";
  const std::string lives = text("lives.csv");
  EXPECT_EQ(std::count(lives.begin(), lives.end(), '\n'), 3) << lives;
  EXPECT_NE(lives.find("\n2,60.000000000,"), std::string::npos) << lives;
}

TEST_F(Lives, ThereMayBeManyAndTheFirstMayHaveMeasuredNothing) {
  {
    auto r = RunRecord::open(run, kBegin);
    ASSERT_TRUE(r.ok());
  }
  for (int life = 2; life <= 4; ++life) {
    auto r = RunRecord::open(run, {100.0 + life, 1}, {.goes_on = true});
    ASSERT_TRUE(r.ok()) << r.error().text;
    EXPECT_EQ((*r)->lives(), size_t(life));
    if (life > 2) measure(**r, 100 + life, 1);
    ASSERT_TRUE((*r)->finish({}, {}));
  }
  const json summary = json::parse(text("summary.json"));
  EXPECT_EQ(summary["lives"], 4);
  EXPECT_EQ(summary["frames"], 4);
  EXPECT_TRUE(text("tiles.csv").starts_with("frame,tile,")) << "one header";
  EXPECT_EQ(text("tiles.csv").find("frame,tile,", 1), std::string::npos);
  EXPECT_TRUE(json::accept(text("trace.json")));
}

// A line without an end must not fill the memory of the next master.
TEST_F(Lives, RowsThatAreTooLongAreLeftOut) {
  live_and_be_killed(101);
  const std::string rows = text("frames.csv");
  const size_t begin = rows.find('\n') + 1;
  const std::string row = rows.substr(begin, rows.find('\n', begin) + 1 - begin);
  append("frames.csv", "v" + std::string(100'000, 'x') + row.substr(row.find(',')));  // as many cells
  append("frames.csv", row);
  auto r = RunRecord::open(run, {103, 1}, {.goes_on = true});
  ASSERT_TRUE(r.ok()) << r.error().text;
  ASSERT_TRUE((*r)->finish({}, {}));
  EXPECT_EQ(json::parse(text("summary.json"))["frames"], 3);
}

TEST_F(Lives, ColumnsStayThoseOfTheFirst) {
  live_and_be_killed(101);
  auto r = RunRecord::open(run, kBegin, {.goes_on = true});
  ASSERT_TRUE(r.ok());
  EXPECT_FALSE((*r)->add_rows(viewer, {{5}, "frames", {"t_s", "another"}, {1, 2}}));
}

TEST_F(Lives, AnotherMachinesClockCountsByTheWallClocks) {
  Life first{.begin = {1000, 50'000'000'000}, .clock = "a"}, same{.begin = {1060, 110'000'000'000}, .clock = "a"};
  EXPECT_EQ(continued(first, same).monotonic_s, 1000);
  Life started_again{.begin = {7, 110'000'000'000}, .clock = "b"};
  EXPECT_NEAR(continued(first, started_again).monotonic_s, 7 - 60, 1e-9);
}

TEST_F(Lives, OnlyARecordThatTellsItsLivesGoesOn) {
  EXPECT_FALSE(may_go_on(run));
  ASSERT_TRUE(begin_folder(run, false, Logs::kOurs));
  EXPECT_FALSE(may_go_on(run)) << "nothing is recorded yet";
  EXPECT_FALSE(RunRecord::open(run, kBegin, {.goes_on = true}));
  live_and_be_killed(101);
  EXPECT_TRUE(may_go_on(run));
  std::filesystem::remove(run + "/frames.csv");
  std::filesystem::create_symlink(folder + "/elsewhere", run + "/frames.csv");
  EXPECT_FALSE(go_on_in_folder(run)) << "nothing is written through a link";
  EXPECT_FALSE(RunRecord::open(run, kBegin, {.goes_on = true}));
}

}  // namespace
}  // namespace telesplat::metrics
