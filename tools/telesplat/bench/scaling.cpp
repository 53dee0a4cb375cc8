// `telesplat bench scaling`: how a Julia set's frame speeds up with the number of samplers (T7.3, table 7.2), with real
// processes, leases and messages. Where samplers outnumber the processors, the computing of each row is replaced by a
// wait of its measured cost. Leaves scaling.csv, scaling.json, scaling.png and the runs' records.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <thread>

#include "client/viewer/display/size_text.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/geometry/trajectory.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/bench/bench_commands.h"
#include "tools/telesplat/bench/number_list.h"
#include "tools/telesplat/bench/rows.h"
#include "tools/telesplat/bench/scaling_report.h"
#include "tools/telesplat/bench/session.h"
#include "tools/telesplat/run/pipeline.h"

namespace telesplat::launcher {
namespace {

constexpr double kRoom_m = 0.8, kFov_deg = 90;  // as `telesplat run` has them
constexpr double kCheap = 20;                   // the second series' rows are so many times cheaper
constexpr int kPasses = 5;                      // over the rows, when their costs are measured
constexpr int kComputedFrames = 20, kKillFrames = 5;
constexpr double kKillAt = 0.5;  // of a frame's normal time

struct ScalingOptions {
  std::vector<int> nodes{1, 2, 4, 8, 16, 32, 40};
  std::string size = "1024x640";
  julia::SceneOptions scene;
  std::string row_cost = "both";  ///< "thesis", "cheap" (20 times cheaper), "both", "measured", or seconds a frame
  int frames = 0;                 ///< measured for each number of nodes, the median counts; 0: as many as seem worth it
  std::string out = "scaling";
  bool kill = true, computed = true;
};

class Study {
 public:
  Study(const ScalingOptions& o, julia::Scene scene, geometry::Camera camera)
      : options_(o), scene_(std::move(scene)), flags_(julia::to_flags(o.scene)), camera_(camera) {
    report_.width = camera.width;
    report_.height = camera.height;
    report_.cores = usable_processors();
    report_.scene = scene_.title;
  }

  Status run() {
    if (const Status s = measure(); !s) return s;
    if (options_.computed)
      if (const Status s = computed(); !s) return s;
    for (const auto& [name, seconds] : costs())
      if (const Status s = simulated(name, seconds); !s) return s;
    if (options_.kill)
      if (const Status s = kills(); !s) return s;
    progress_.close();
    return write_report(report_, options_.out);
  }

 private:
  std::vector<std::pair<std::string, double>> costs() const {
    const std::string& c = options_.row_cost;
    if (c == "thesis") return {{"thesis rows", kThesisSingle_s}};
    if (c == "cheap") return {{"rows 20 times cheaper", kThesisSingle_s / kCheap}};
    if (c == "both") return {{"thesis rows", kThesisSingle_s}, {"rows 20 times cheaper", kThesisSingle_s / kCheap}};
    if (c == "measured") return {{"rows as measured here", rows_s_}};
    return {{"rows as asked for", std::strtod(c.c_str(), nullptr)}};
  }

  Status measure() {
    auto replay = measure_rows(
        scene_, kRoom_m, camera_, kPasses,
        [&](int done, int of) { progress_.show(fmt::format("measuring rows: {} of {}", done, of)); },
        net::stop_requested);
    if (!replay) return replay.error();
    rows_s_ = std::accumulate(replay->row_cost_s.begin(), replay->row_cost_s.end(), 0.0);
    const auto [least, most] = std::minmax_element(replay->row_cost_s.begin(), replay->row_cost_s.end());
    say(fmt::format(
        "{}, {}x{}: its {} rows, each sampled alone on one thread, take {:.3f} s ({:.2f} to {:.2f} ms a row)\n",
        scene_.title, camera_.width, camera_.height, camera_.height, rows_s_, *least * 1e3, *most * 1e3));
    replay_path_ = options_.out + "/rows.replay";
    return write_replay(replay_path_, *replay);
  }

  std::vector<std::string> replay_flags(double frame_s) const {
    return {"--replay", replay_path_, "--cost-scale", fmt::format("{:.9g}", frame_s / rows_s_)};
  }
  static std::vector<std::string> compute_flags() { return {"--threads", "1"}; }

  // The times of `frames` frames.
  Result<std::vector<double>> frames(BenchSession& session, int nodes, int frames, double expected_s,
                                     const std::string& name) {
    std::vector<double> times;
    for (int i = 0; i < frames; ++i) {
      const auto watch = [&](const BenchSession::Progress& p) {
        progress_.show(fmt::format("{}: {} node{}, frame {} of {}: {} of {} rows, {:.1f} s to go", name, nodes,
                                   nodes == 1 ? "" : "s", i + 1, frames, p.rows, camera_.height,
                                   std::max(0.0, expected_s - p.elapsed_s)));
      };
      const auto time_s = session.frame(camera_, 20 + expected_s, watch);
      if (!time_s) return time_s.error();
      times.push_back(*time_s);
    }
    return times;
  }

  Status simulated(const std::string& name, double frame_s) {
    auto session = BenchSession::start(flags_, folder(name), true);
    if (!session) return session.error();
    ScalingSeries series{name, true, frame_s, {}};
    std::vector<int> nodes = options_.nodes;
    std::sort(nodes.begin(), nodes.end());
    for (const int n : nodes) {
      if (const Status s = (*session)->add_samplers(size_t(n), replay_flags(frame_s)); !s) return s;
      // As many frames as fit into two seconds, so that the median means something.
      const int count = options_.frames ? options_.frames : std::clamp(int(2 * n / frame_s), 1, 11);
      const auto times = frames(**session, n, count, frame_s / n, name);
      if (!times) return times.error();
      series.points.push_back({n, count, metrics::distribution(*times).median});
    }
    (*session)->finish();
    report_.series.push_back(series);
    say("\n" + to_text(series, report_.cores));
    return ok_status();
  }

  // As many samplers as there are processors, sampling in earnest.
  Status computed() {
    ScalingSeries series{"computed", false, rows_s_, {}};
    const int count = options_.frames ? options_.frames : kComputedFrames;
    for (const int n : options_.nodes) {
      if (n > report_.cores) continue;
      auto session = BenchSession::start(flags_, folder(fmt::format("computed-{}", n)), false);
      if (!session) return session.error();
      if (const Status s = (*session)->add_samplers(size_t(n), compute_flags()); !s) return s;
      const auto warm = frames(**session, n, 2, rows_s_ / n, "computed");  // the master learns what rows cost
      if (!warm) return warm.error();
      const RequestId last_warm = (*session)->request();
      const auto times = frames(**session, n, count, rows_s_ / n, "computed");
      if (!times) return times.error();
      (*session)->finish();
      const auto busy = busy_times((*session)->directory() + "/tiles.csv", last_warm);
      if (!busy) return busy.error();
      const auto d = metrics::distribution(*times);
      series.points.push_back({n, count, d.median});
      report_.computed.push_back({n, count, d.median, d.p95, *busy});
    }
    if (series.points.empty()) return ok_status();
    report_.series.push_back(series);
    say("\n" + to_text(series, report_.cores));
    for (const auto& c : report_.computed) say(to_text(c));
    return ok_status();
  }

  Status kills() {
    say("\n");
    const double simulated_s = kThesisSingle_s / kCheap;
    for (const auto& [name, n, flags, frame_s] :
         {std::tuple{std::string("simulated, rows 20 times cheaper"), 4, replay_flags(simulated_s), simulated_s},
          {std::string("computed"), 2, compute_flags(), rows_s_}}) {
      auto session = BenchSession::start(flags_, folder(fmt::format("kill-{}", n)), name != "computed");
      if (!session) return session.error();
      if (const Status s = (*session)->add_samplers(size_t(n), flags); !s) return s;
      const auto normal = frames(**session, n, kKillFrames, frame_s / n, "kill");
      if (!normal) return normal.error();
      KillResult result{name, n, metrics::distribution(*normal).median, 0};
      bool killed = false;
      const auto time_s = (*session)->frame(camera_, 20 + frame_s, [&](const BenchSession::Progress& p) {
        if (!killed && p.elapsed_s >= kKillAt * result.normal_s) (*session)->kill_sampler(0), killed = true;
      });
      if (!time_s) return time_s.error();
      if (!killed) {
        (*session)->finish();
        say(fmt::format("no sampler of {} was killed: the frame was complete before\n", n));
        continue;
      }
      result.killed_s = *time_s;
      (*session)->finish();
      report_.kills.push_back(result);
      say(to_text(result));
    }
    return ok_status();
  }

  std::string folder(std::string name) const {
    std::replace(name.begin(), name.end(), ' ', '-');
    return options_.out + "/" + name;
  }
  void say(const std::string& text) {
    progress_.close();
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);
  }

  const ScalingOptions& options_;
  julia::Scene scene_;
  std::vector<std::string> flags_;
  geometry::Camera camera_;
  std::string replay_path_;
  double rows_s_ = 0;
  ScalingReport report_;
  tools::ProgressLine progress_;
};

// The plot is made by a script beside the sources or where programs are installed; it is a convenience.
void plot(const std::string& directory) {
  for (const char* place : {"/../../../tools/plot-scaling", "/plot-scaling"}) {
    const std::string script = program_directory() + place;
    if (!std::filesystem::exists(script)) continue;
    auto child = ChildProcess::start("plot-scaling", script, {directory}, directory + "/plot.log", 0);
    if (child) {
      for (const double until = monotonic_s() + 60; !child->ended() && monotonic_s() < until;)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (child->ended() && child->exit_code() == 0) {
        std::printf("plot: %s/scaling.png\n", directory.c_str());
        return;
      }
    }
    std::printf("no plot: %s failed, see %s/plot.log (it needs python3-matplotlib)\n", script.c_str(),
                directory.c_str());
    return;
  }
  std::printf("no plot: tools/plot-scaling was not found; run it with %s when you have it\n", directory.c_str());
}

std::string complain_about_cost(const std::string& v) {
  if (v == "thesis" || v == "cheap" || v == "both" || v == "measured") return {};
  char* end = nullptr;
  const double seconds = std::strtod(v.c_str(), &end);
  return !v.empty() && *end == 0 && seconds >= 0.01 && seconds <= 3600
             ? std::string()
             : std::string("is neither thesis, cheap, both, measured nor 0.01..3600 seconds");
}

options::Table table(ScalingOptions& o) {
  return joined(
      {{.flag = "--nodes", .value = number_list(o.nodes, 1, 256), .help = "numbers of samplers"},
       {.flag = "--size", .value = &o.size, .help = "pixels of the frame, WxH"},
       {.flag = "--frames",
        .value = &o.frames,
        .help = "frames to measure for each number of samplers; 0: as many as seem worth it",
        .limits = options::Range{0, 1000}},
       {.flag = "--row-cost",
        .value = &o.row_cost,
        .help =
            "what all rows of a frame cost one sampler, where they are waited for: thesis (69.3 s), cheap (a 20th of "
            "it), both, measured (what they cost here), or seconds",
        .limits = options::Check(complain_about_cost)},
       {.flag = "!--no-kill", .value = &o.kill, .help = "do not kill samplers in mid-frame"},
       {.flag = "!--no-computed", .value = &o.computed, .help = "compute no frames in earnest"},
       {.flag = "--out", .value = &o.out, .help = "folder for tables, plot and the runs' records"}},
      julia::scene_table(o.scene));
}

int bench_scaling(ScalingOptions o, const options::Given&) {
  log::initialise("bench", "warn");
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return tools::complain(size.error());
  auto scene = julia::read_scene(o.scene);
  if (!scene) return tools::complain(scene.error());
  if (!scene->timeline.empty()) return tools::complain({"--animate: the scaling study is of one frame"});
  std::error_code error;
  std::filesystem::create_directories(o.out, error);
  if (error) return tools::complain({fmt::format("{}: cannot be made: {}", o.out, error.message())});
  net::install_signal_handlers();
  const auto camera = geometry::make_camera(geometry::default_pose(), kFov_deg, size->first, size->second);
  if (const Status s = Study(o, std::move(*scene), camera).run(); !s) return tools::complain(s.error(), 1);
  std::printf("\nrecord: %s\n", o.out.c_str());
  plot(o.out);
  return 0;
}

}  // namespace

Command bench_scaling_command() {
  return make_command("scaling",
                      "how a Julia set's frame speeds up with the number of samplers, beside table 7.2 of the thesis",
                      table, bench_scaling);
}

}  // namespace telesplat::launcher
