// `telesplat-lab scaling`: measures how a Julia set's frame speeds up with the number of samplers (T7.3, table 7.2),
// with real processes, leases and messages. If samplers outnumber the processors, a wait of its measured cost takes the
// place of computing each row. Writes scaling.csv and the runs' records.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/display/size_text.h"
#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/result.h"
#include "common/core/whole_file.h"
#include "common/geometry/camera.h"
#include "common/geometry/trajectory.h"
#include "common/julia/flags.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "common/options/table.h"
#include "services/sampler/julia/sampler.h"
#include "services/sampler/tiles/replay.h"
#include "tools/common/progress_line.h"
#include "tools/lab/commands.h"
#include "tools/lab/scaling/session.h"

namespace telesplat::lab {
namespace {

constexpr double kRoom_m = 0.8, kFov_deg = 90;  // the same as in `telesplat run`
constexpr double kCheap = 20;                   // a row of the second series costs 1 / kCheap
constexpr int kScalingPasses = 5;               // passes over the rows to measure their costs
constexpr int kComputedFrames = 20;

/// One number of nodes in one series.
struct ScalingPoint {
  int nodes = 0, frames = 0;
  double time_s = 0;  ///< median, from request to the frame's last patch at the viewer
};

/// One series: the source of the rows' costs, and its points.
struct ScalingSeries {
  std::string name;  ///< "thesis rows", ...
  bool simulated = false;
  double row_seconds = 0;  ///< cost of all rows of the frame on one node
  std::vector<ScalingPoint> points;
  /// Returns T(1) / T(N) and T(1) / (N T(N)); nothing if T(1) was not measured.
  std::optional<double> speed_up(const ScalingPoint& p) const {
    for (const auto& one : points)
      if (one.nodes == 1) return one.time_s / p.time_s;
    return std::nullopt;
  }
  std::optional<double> efficiency(const ScalingPoint& p) const {
    const auto s = speed_up(p);
    return s ? std::optional(*s / p.nodes) : std::nullopt;
  }
};

constexpr double kThesisSingle_s = 69.3;
// Returns the thesis' time on this many nodes (table 7.2), seconds; nothing for numbers that the table lacks.
std::optional<double> thesis_time_s(int nodes) {
  static const std::map<int, double> table{{1, kThesisSingle_s}, {2, 34.8},  {4, 17.3}, {8, 8.7},
                                           {16, 4.36},           {32, 2.19}, {40, 1.76}};
  const auto it = table.find(nodes);
  return it == table.end() ? std::nullopt : std::optional(it->second);
}

std::string number(const std::optional<double>& v, int decimals) {
  return v ? fmt::format("{:.{}f}", *v, decimals) : std::string("-");
}
std::optional<double> thesis_efficiency(int nodes) {
  const auto t = thesis_time_s(nodes);
  if (!t) return std::nullopt;
  return kThesisSingle_s / (nodes * *t);
}
std::optional<double> percent(const std::optional<double>& v) { return v ? std::optional(*v * 100) : std::nullopt; }

std::string to_text(const ScalingSeries& s, int cores) {
  std::string out = fmt::format("{}: rows of {:.3f} s a frame in all\n", s.name, s.row_seconds);
  if (s.simulated)
    out += fmt::format(
        "  simulated: the samplers are real processes, all on {} cores; each row waits its measured cost x scale, then "
        "the row as sampled before is encoded and sent\n",
        cores);
  else
    out += fmt::format("  computed: the samplers sample every frame anew, one thread each, on {} cores\n", cores);
  out += "  nodes    time s  speed-up  efficiency   thesis s  efficiency\n";
  for (const auto& p : s.points)
    out += fmt::format("  {:5} {:9.4f} {:>9} {:>9} % {:>10} {:>9} %\n", p.nodes, p.time_s, number(s.speed_up(p), 2),
                       number(percent(s.efficiency(p)), 1), number(thesis_time_s(p.nodes), 2),
                       number(percent(thesis_efficiency(p.nodes)), 1));
  return out;
}

// Writes scaling.csv.
Status write_report(const std::vector<ScalingSeries>& all, const std::string& directory) {
  std::string csv = "series,simulated,row_seconds,nodes,frames,time_s,speed_up,efficiency,thesis_s,thesis_efficiency\n";
  const auto value = [](const std::optional<double>& v) { return v ? fmt::format("{:.6f}", *v) : std::string(); };
  for (const auto& s : all)
    for (const auto& p : s.points)
      csv += fmt::format("{},{},{:.6f},{},{},{:.6f},{},{},{},{}\n", s.name, int(s.simulated), s.row_seconds, p.nodes,
                         p.frames, p.time_s, value(s.speed_up(p)), value(s.efficiency(p)),
                         value(thesis_time_s(p.nodes)), value(thesis_efficiency(p.nodes)));
  return write_whole(directory + "/scaling.csv", csv);
}

struct ScalingOptions {
  std::vector<int> nodes{1, 2, 4, 8, 16, 32, 40};
  std::string size = "1024x640";
  julia::SceneOptions scene;
  std::string row_cost = "both";  ///< "thesis", "cheap" (20 times cheaper), "both", "measured", or seconds a frame
  int frames = 0;                 ///< timed for each number of nodes; the median counts; 0: chosen by their cost
  std::string out = "scaling";
  bool computed = true;
};

// Samples and encodes each row of `camera`'s frame `passes` times on one thread, as a sampler does a lease of one row.
// A row's cost is the median. Error: the scene's slice is empty. progress(rows done, of); true from `stop` ends it
// early, with an error.
Result<sampler::Replay> measure_rows(const julia::Scene& scene, double room_size_m, const geometry::Camera& camera,
                                     int passes, const std::function<void(int, int)>& progress,
                                     const std::function<bool()>& stop) {
  const auto placement = julia::place(scene, room_size_m);
  if (!placement) return placement.error();
  const sampler::JuliaScene set(scene.parameters, *placement);
  sampler::JuliaSampler sampler(1);
  sampler::Replay out{{camera.width, camera.height}, {}};
  std::vector<std::vector<double>> costs(camera.height);
  for (int pass = 0; pass < passes; ++pass)
    for (int y = 0; y < camera.height; ++y) {
      if (stop()) return Error{"interrupted"};
      const double begin_s = monotonic_s();
      const auto row = sampler.sample(set, camera, {0, y, camera.width, 1}, 1);
      const auto stream = codec::encode(row);
      costs[y].push_back(monotonic_s() - begin_s);
      const size_t at = size_t(y) * camera.width;
      std::copy(row.depth.begin(), row.depth.end(), out.frame.depth.begin() + at);
      std::copy(row.colour.begin(), row.colour.end(), out.frame.colour.begin() + at);
      std::copy(row.normal.begin(), row.normal.end(), out.frame.normal.begin() + at);
      progress(pass * camera.height + y + 1, passes * camera.height);
    }
  for (auto& c : costs) {
    std::nth_element(c.begin(), c.begin() + c.size() / 2, c.end());
    out.row_cost_s.push_back(c[c.size() / 2]);
  }
  return out;
}

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

  // Returns the times of `frames` frames, seconds.
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

  // Starts as many samplers as there are processors; they sample in earnest.
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

// Reads a flag with several numbers, "1,2,4", each within least..most.
options::Text number_list(std::vector<int>& value, int least, int most) {
  const auto read = [&value, least, most](const std::string& text) -> Status {
    value.clear();
    for (size_t begin = 0; begin <= text.size();) {
      const size_t comma = std::min(text.find(',', begin), text.size());
      int n = 0;
      const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + comma, n);
      if (error != std::errc() || stop != text.data() + comma || n < least || n > most)
        return Error{fmt::format("\"{}\" is not in {}..{}", text.substr(begin, comma - begin), least, most)};
      value.push_back(n);
      begin = comma + 1;
    }
    return ok_status();
  };
  return {.read = read, .write = [&value] { return fmt::format("{}", fmt::join(value, ",")); }};
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
       {.flag = "!--no-computed", .value = &o.computed, .help = "compute no frames in earnest"},
       {.flag = "--out", .value = &o.out, .help = "folder for the table and the runs' records"}},
      julia::scene_table(o.scene));
}

int scaling(ScalingOptions o, const options::Given&) {
  log::initialise("telesplat-lab", "warn");
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return complain(size.error());
  auto scene = julia::read_scene(o.scene);
  if (!scene) return complain(scene.error());
  if (!scene->timeline.empty()) return complain({"--animate: the scaling study is of one frame"});
  std::error_code error;
  std::filesystem::create_directories(o.out, error);
  if (error) return complain({fmt::format("{}: cannot be made: {}", o.out, error.message())});
  net::install_signal_handlers();
  const auto camera = geometry::make_camera(geometry::default_pose(), kFov_deg, size->first, size->second);
  if (const Status s = Study(o, std::move(*scene), camera).run(); !s) return complain(s.error(), 1);
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
