// `telesplat-lab scaling`: how a Julia set's frame speeds up with the number of samplers (T7.3, table 7.2), with real
// processes, leases and messages. Where samplers outnumber the processors, the computing of each row is replaced by a
// wait of its measured cost. Leaves scaling.csv and the runs' records.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numeric>

#include "client/viewer/display/size_text.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/geometry/trajectory.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/lab/commands.h"
#include "tools/lab/scaling/number_list.h"
#include "tools/lab/scaling/report.h"
#include "tools/lab/scaling/rows.h"
#include "tools/lab/scaling/session.h"

namespace telesplat::lab {
namespace {

constexpr double kRoom_m = 0.8, kFov_deg = 90;  // as `telesplat run` has them
constexpr double kCheap = 20;                   // the second series' rows are so many times cheaper
constexpr int kScalingPasses = 5;                      // over the rows, when their costs are measured
constexpr int kComputedFrames = 20;

struct ScalingOptions {
  std::vector<int> nodes{1, 2, 4, 8, 16, 32, 40};
  std::string size = "1024x640";
  julia::SceneOptions scene;
  std::string row_cost = "both";  ///< "thesis", "cheap" (20 times cheaper), "both", "measured", or seconds a frame
  int frames = 0;                 ///< measured for each number of nodes, the median counts; 0: as many as seem worth it
  std::string out = "scaling";
  bool computed = true;
};

class Study {
 public:
  Study(const ScalingOptions& o, julia::Scene scene, geometry::Camera camera)
      : options_(o), scene_(std::move(scene)), flags_(julia::to_flags(o.scene)), camera_(camera) {}

  Status run() {
    if (const Status s = measure(); !s) return s;
    if (options_.computed)
      if (const Status s = computed(); !s) return s;
    for (const auto& [name, seconds] : costs())
      if (const Status s = simulated(name, seconds); !s) return s;
    progress_.close();
    return write_report(series_, options_.out);
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
        scene_, kRoom_m, camera_, kScalingPasses,
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
  Result<std::vector<double>> frames(Session& session, int nodes, int frames, double expected_s,
                                     const std::string& name) {
    std::vector<double> times;
    for (int i = 0; i < frames; ++i) {
      const auto watch = [&](const Session::Progress& p) {
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
    auto session = Session::start(flags_, folder(name), true);
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
    keep(std::move(series));
    return ok_status();
  }

  // As many samplers as there are processors, sampling in earnest.
  Status computed() {
    ScalingSeries series{"computed", false, rows_s_, {}};
    const int count = options_.frames ? options_.frames : kComputedFrames;
    for (const int n : options_.nodes) {
      if (n > cores_) continue;
      auto session = Session::start(flags_, folder(fmt::format("computed-{}", n)), false);
      if (!session) return session.error();
      if (const Status s = (*session)->add_samplers(size_t(n), compute_flags()); !s) return s;
      const auto warm = frames(**session, n, 2, rows_s_ / n, "computed");  // the master learns what rows cost
      if (!warm) return warm.error();
      const auto times = frames(**session, n, count, rows_s_ / n, "computed");
      if (!times) return times.error();
      series.points.push_back({n, count, metrics::distribution(*times).median});
    }
    if (!series.points.empty()) keep(std::move(series));
    return ok_status();
  }

  std::string folder(std::string name) const {
    std::replace(name.begin(), name.end(), ' ', '-');
    return options_.out + "/" + name;
  }
  void keep(ScalingSeries series) {
    say("\n" + to_text(series, cores_));
    series_.push_back(std::move(series));
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
  int cores_ = usable_processors();
  std::vector<ScalingSeries> series_;
  tools::ProgressLine progress_;
};

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
       {.flag = "!--no-computed", .value = &o.computed, .help = "compute no frames in earnest"},
       {.flag = "--out", .value = &o.out, .help = "folder for the table and the runs' records"}},
      julia::scene_table(o.scene));
}

int scaling(ScalingOptions o, const options::Given&) {
  log::initialise("telesplat-lab", "warn");
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
  return 0;
}

}  // namespace

launcher::Command scaling_command() {
  return launcher::make_command(
      "scaling",
      "measure how a Julia set's frame speeds up with the number of samplers, beside table 7.2 of the thesis", table,
      scaling);
}

}  // namespace telesplat::lab
