// `telesplat bench volume`: how fast views of a volume are constructed with 1 to 4 samplers and 1 to 4 viewers of a
// display wall, as tables 7.3 and 7.4 of the thesis have it. Once with all processes computing, on the processors that
// are here; once with a processor for each, by waiting for what was measured. Leaves volume.csv, volume.md and the
// runs' records.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <numeric>
#include <thread>

#include "common/core/clock.h"
#include "common/core/machine.h"
#include "common/geometry/trajectory.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "common/volume/session.h"
#include "services/data/volume/volume.h"
#include "tools/common/complain.h"
#include "tools/common/csv_table.h"
#include "tools/common/progress_line.h"
#include "tools/make_volume/tree.h"
#include "tools/telesplat/bench/bench_commands.h"
#include "tools/telesplat/bench/number_list.h"
#include "tools/telesplat/bench/processes.h"
#include "tools/telesplat/bench/volume_report.h"
#include "tools/telesplat/bench/wall.h"
#include "tools/telesplat/run/pipeline.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr int kRepeat = 3;         // times that a simulated sampler computes a view before it repeats it
constexpr int kWarmViews = 12;     // of each viewer, before anything is measured
constexpr double kSettle_s = 0.5;  // left out at both ends of what is measured
constexpr double kDataPatience_s = 300, kPatience_s = 60;

struct VolumeBenchOptions {
  /// Voxels a side of the volume that is made up if data names none.
  int generated_side = 256;
  data::DataOptions data;  ///< the volume, transfer function and lighting to show
  std::vector<int> samplers{1, 2, 3, 4}, viewers{1, 2, 3, 4};
  std::string size = "1600x1200";  ///< pixels of the wall, shared by its viewers
  double fov_deg = 60;
  int buffers = 3;
  double seconds = 4;  ///< measured of each combination
  std::string out = "volume-bench";
  bool computed = true, simulated = true;
};

double mean_of(const std::vector<double>& v) {
  return v.empty() ? 0 : std::accumulate(v.begin(), v.end(), 0.0) / double(v.size());
}

// Columns of numbers of a file that this program's own processes wrote.
Result<std::vector<std::vector<double>>> numbers_of(const tools::CsvTable& table,
                                                    const std::vector<const char*>& names) {
  std::vector<std::vector<double>> out;
  for (const char* name : names) {
    const auto column = table.column(name);
    if (!column) return column.error();
    out.push_back(table.numbers(*column));
  }
  return out;
}

// Medians over the slabs that were leased in [from_s, to_s) of the master's clock.
Status add_slab_times(const std::string& directory, double from_s, double to_s, VolumePoint& point) {
  const auto table = tools::CsvTable::read(directory + "/tiles.csv", {});
  if (!table) return table.error();
  const auto columns = numbers_of(*table, {"leased_s", "sample_begin_s", "encode_end_s", "receive_s", "packed_s"});
  if (!columns) return columns.error();
  const auto &leased = (*columns)[0], &begin = (*columns)[1], &end = (*columns)[2], &received = (*columns)[3],
             &packed = (*columns)[4];
  std::vector<double> sampling, packing;
  for (size_t i = 0; i < leased.size(); ++i) {
    if (leased[i] < from_s || leased[i] >= to_s) continue;
    sampling.push_back(1e3 * (end[i] - begin[i]));
    packing.push_back(1e3 * (packed[i] - received[i]));
  }
  point.sampling_ms = metrics::distribution(sampling).median;
  point.packing_ms = metrics::distribution(packing).median;
  return ok_status();
}

class VolumeStudy {
 public:
  VolumeStudy(const VolumeBenchOptions& o, int width, int height) : options_(o), width_(width), height_(height) {
    report_.size = o.size;
    report_.cores = usable_processors();
    report_.buffers = o.buffers;
  }

  Status run() {
    if (const Status s = find_volume(); !s) return s;
    for (const int samplers : options_.samplers)
      for (const int viewers : options_.viewers)
        if (options_.computed)
          if (const Status s = computed(samplers, viewers); !s) return s;
    for (const int samplers : options_.samplers)
      if (options_.simulated)
        if (const Status s = simulated(samplers); !s) return s;
    progress_.close();
    std::printf("%s", to_markdown(report_).c_str());
    return write_report(report_, options_.out);
  }

 private:
  Status find_volume() {
    path_ = options_.data.scene;
    report_.volume = fs::path(path_).filename().string();
    if (!path_.empty()) return ok_status();
    const int side = options_.generated_side;
    path_ = fmt::format("{}/tree-{}.nrrd", options_.out, side);
    report_.volume = fmt::format("a made-up scan of a Christmas tree, {0} x {0} x {0} voxels of 16 bit", side);
    std::error_code error;
    if (fs::exists(path_, error)) return ok_status();
    const auto scan = made_volume::make_tree(
        side, 1, [&](double f) { progress_.show(fmt::format("making a volume: {:.0f} %", 100 * f)); });
    if (net::stop_requested()) return Error{"interrupted"};
    return made_volume::write_scan(scan, 16, path_);
  }

  // The wall's viewers side by side; the last one has what is left over.
  geometry::Rect tile(int viewers, int i) const {
    const int from = width_ * i / viewers, to = width_ * (i + 1) / viewers;
    return {from, 0, to - from, height_};
  }

  Status computed(int samplers, int viewers) {
    const RunOptions o = run_options(samplers, viewers);
    if (const Status s = show(o); !s) return s;
    VolumePoint point{false, samplers, viewers};
    if (const Status s = read_frames(o.out, point); !s) return s;
    if (const Status s = add_slab_times(o.out, 0, 1e18, point); !s) return s;
    add(point);
    return ok_status();
  }

  data::DataServiceOptions data_options() const {
    data::DataServiceOptions out;
    static_cast<data::DataOptions&>(out) = options_.data;
    out.scene = path_;
    out.volume.steps_per_s = 0;
    return out;
  }

  RunOptions run_options(int samplers, int viewers) const {
    RunOptions o;
    o.data = data_options();
    o.samplers = samplers;
    o.viewers = viewers;
    o.sampler.threads = 1;
    auto& v = o.viewer;
    if (viewers > 1) v.wall = fmt::format("{}x1", viewers);
    v.size = fmt::format("{}x{}", width_ / viewers, height_);
    v.sampling_size = v.size;
    v.trajectory = "still";
    v.coupling = "loose";
    v.buffers = options_.buffers;
    v.display.fov_deg = options_.fov_deg;
    v.display.target_fps = 0;
    v.duration_s = options_.seconds + 2 * kSettle_s;
    v.display.picture_every = 0;
    v.record_points_mb = 0;
    v.started_s = monotonic_s();
    o.out = fmt::format("{}/computed-{}x{}", options_.out, samplers, viewers);
    o.log_level = "warn";
    return o;
  }

  // A whole run.
  Status show(const RunOptions& o) {
    std::error_code error;
    fs::remove_all(o.out, error);
    auto pipeline = Pipeline::start(o);
    if (!pipeline) return pipeline.error();
    auto state = Pipeline::State::kRunning;
    for (const double until = monotonic_s() + kDataPatience_s + options_.seconds; state == Pipeline::State::kRunning;) {
      std::vector<std::string> news;
      state = pipeline->supervise(news);
      for (const auto& n : news) progress_.line(n);
      if (net::stop_requested()) return Error{"interrupted"};
      if (monotonic_s() > until) return Error{fmt::format("nothing was shown; see {}/logs", o.out)};
      progress_.show(
          fmt::format("computed: {} sampler(s), {} viewer(s) {}", o.samplers, o.viewers, pipeline->progress()));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    pipeline->finish();
    if (state != Pipeline::State::kFinished) return Error{fmt::format("the run failed; see {}/logs", o.out)};
    return ok_status();
  }

  // What the viewers of a run did between its first and last moments.
  Status read_frames(const std::string& directory, VolumePoint& point) const {
    const auto table = tools::CsvTable::read(directory + "/frames.csv", {});
    if (!table) return table.error();
    const auto columns = numbers_of(*table, {"t_s", "construction_ms"});
    const auto viewer = table->column("viewer");
    if (!columns) return columns.error();
    if (!viewer) return viewer.error();
    std::map<std::string, std::vector<double>> shown;
    std::vector<double> construction;
    for (size_t i = 0; i < table->rows(); ++i) {
      const double t = (*columns)[0][i];
      if (t < kSettle_s || t > kSettle_s + options_.seconds) continue;
      shown[table->text(i, *viewer)].push_back(t);
      construction.push_back((*columns)[1][i]);
    }
    std::vector<double> rates;
    for (const auto& [name, t] : shown) rates.push_back(double(t.size()) / options_.seconds);
    rates.resize(size_t(point.viewers));  // one that showed nothing counts, too
    point.fps = mean_of(rates);
    point.least_fps = *std::min_element(rates.begin(), rates.end());
    point.construction_ms = metrics::distribution(construction).median;
    if (const auto updates = tools::CsvTable::read(directory + "/updates.csv", {}))
      if (const auto bytes = updates->find("bytes")) point.bytes_per_frame = mean_of(updates->numbers(*bytes));
    return ok_status();
  }

  Status simulated(int samplers) {
    data::DataServiceOptions data = data_options(), usual;
    const std::string directory = fmt::format("{}/simulated-{}", options_.out, samplers);
    std::error_code error;
    fs::remove_all(directory, error);
    auto processes = BenchProcesses::start(options::arguments(table(data), table(usual)), {}, directory, true);
    if (!processes) return processes.error();
    if (const Status s = (*processes)->wait_for_data(kDataPatience_s, [] {}); !s) return s;
    if (const Status s =
            (*processes)
                ->add_samplers(size_t(samplers), {"--threads", "1", "--repeat-views", std::to_string(kRepeat)}, [] {});
        !s)
      return s;
    struct Window {
      VolumePoint point;
      double from_s, to_s;
    };
    std::vector<Window> windows;
    for (const int viewers : options_.viewers) {
      Window w{{true, samplers, viewers}, 0, 0};
      if (const Status s = simulated_wall(**processes, w.point, w.from_s, w.to_s); !s) return s;
      windows.push_back(w);
    }
    (*processes)->finish();
    for (auto& w : windows) {
      if (const Status s = add_slab_times(directory, w.from_s, w.to_s, w.point); !s) return s;
      add(w.point);
    }
    return ok_status();
  }

  using Wall = std::vector<std::unique_ptr<WaitingViewer>>;

  // Each viewer has turns as often as it needs, until `done`.
  Status go_on(BenchProcesses& processes, Wall& wall, const std::vector<double>& costs, bool asks, double patience_s,
               const std::function<bool()>& done) {
    for (const double until = monotonic_s() + patience_s; !done();) {
      if (const Status s = processes.alive(); !s) return s;
      double next_s = monotonic_s() + 1;
      std::vector<net::Socket*> sockets;
      for (size_t i = 0; i < wall.size(); ++i) {
        next_s = std::min(next_s, wall[i]->turn(monotonic_s(), costs[i], asks));
        for (auto* socket : wall[i]->sockets()) sockets.push_back(socket);
      }
      if (monotonic_s() > until) return Error{fmt::format("views do not arrive; see {}/logs", processes.directory())};
      if (const double wait_s = next_s - monotonic_s(); wait_s > 0) net::wait_readable_s(sockets, wait_s);
    }
    return ok_status();
  }

  // Until every viewer has had some views and none is on its way.
  Status warm_up(BenchProcesses& processes, Wall& wall, const std::vector<double>& costs) {
    const Status s = go_on(processes, wall, costs, true, kPatience_s, [&] {
      return std::all_of(wall.begin(), wall.end(), [](const auto& v) { return v->shown_s().size() >= kWarmViews; });
    });
    if (!s) return s;
    return go_on(processes, wall, costs, false, kPatience_s,
                 [&] { return std::all_of(wall.begin(), wall.end(), [](const auto& v) { return v->open() == 0; }); });
  }

  // What each viewer's newest view takes to construct.
  Result<std::vector<ConstructionCost>> measure(const Wall& wall) const {
    std::vector<ConstructionCost> out;
    for (const auto& viewer : wall) {
      const auto session = volume::read_session(viewer->session()->parameters, viewer->session()->facts);
      if (!session) return session.error();
      const auto cost = measure_view(*viewer->newest(), session->grid, viewer->camera(), 5);
      if (!cost) return cost.error();
      out.push_back(*cost);
    }
    return out;
  }

  Status simulated_wall(BenchProcesses& processes, VolumePoint& point, double& from_s, double& to_s) {
    const auto whole = geometry::make_camera(geometry::default_pose(), options_.fov_deg, width_, height_);
    net::Context context;
    Wall wall;
    for (int i = 0; i < point.viewers; ++i)
      wall.push_back(std::make_unique<WaitingViewer>(context, processes.endpoint(), fmt::format("viewer-{}", i + 1),
                                                     geometry::crop(whole, tile(point.viewers, i)), options_.buffers));
    progress_.show(fmt::format("simulated: {} sampler(s), {} viewer(s)", point.samplers, point.viewers));
    std::vector<double> costs(wall.size(), 1e-3), bytes, rates;
    if (const Status s = warm_up(processes, wall, costs); !s) return s;
    const auto measured = measure(wall);
    if (!measured) return measured.error();
    for (size_t i = 0; i < wall.size(); ++i) {
      costs[i] = (*measured)[i].total_s();
      bytes.push_back(double((*measured)[i].bytes));
    }
    const double begin_s = monotonic_s() + kSettle_s, end_s = begin_s + options_.seconds;
    const Status shown =
        go_on(processes, wall, costs, true, kPatience_s + options_.seconds, [&] { return monotonic_s() > end_s; });
    if (!shown) return shown;
    const auto in_time = [&](double t) { return t >= begin_s && t < end_s; };
    for (const auto& v : wall)
      rates.push_back(double(std::count_if(v->shown_s().begin(), v->shown_s().end(), in_time)) / options_.seconds);
    for (auto& v : wall) v->leave();
    point.fps = mean_of(rates);
    point.least_fps = *std::min_element(rates.begin(), rates.end());
    point.construction_ms = 1e3 * metrics::distribution(costs).median;
    point.bytes_per_frame = mean_of(bytes);
    from_s = begin_s, to_s = end_s;  // one machine, one clock
    return ok_status();
  }

  void add(const VolumePoint& p) {
    report_.points.push_back(p);
    progress_.line(
        fmt::format("{}: {} sampler(s), {} viewer(s): {:.1f} views/s (slowest viewer {:.1f}), sampling {:.1f} ms a "
                    "slab, construction "
                    "{:.1f} ms, {:.0f} kB a view",
                    p.simulated ? "simulated" : "computed", p.samplers, p.viewers, p.fps, p.least_fps, p.sampling_ms,
                    p.construction_ms, p.bytes_per_frame / 1e3));
  }

  const VolumeBenchOptions& options_;
  int width_, height_;
  std::string path_;
  VolumeReport report_;
  tools::ProgressLine progress_;
};

options::Table table(VolumeBenchOptions& o) {
  using options::Range;
  options::Table shown;
  for (options::Row& row : data::scene_table(o.data))
    if (row.fits == scene::Kinds::of(scene::Pipeline::kSlices) || options::name_of(row) == "--raw")
      shown.push_back(std::move(row));
  return joined(
      {{.flag = "--volume",
        .value = &o.data.scene,
        .help = "volume to show; without it a made-up one of --generated voxels a side"},
       {.flag = "--generated",
        .value = &o.generated_side,
        .help = "voxels a side of the made-up volume",
        .limits = Range{double(made_volume::kMinSide), double(made_volume::kMaxSide)}},
       {.flag = "!--unlit", .value = &o.data.volume.lit, .help = "do not shade voxels"},
       {.flag = "--samplers", .value = number_list(o.samplers, 1, 64), .help = "numbers of samplers"},
       {.flag = "--viewers", .value = number_list(o.viewers, 1, kMaxViewers), .help = "numbers of viewers"},
       {.flag = "--size", .value = &o.size, .help = "pixels of the wall that the viewers share, WxH"},
       {.flag = "--fov",
        .value = &o.fov_deg,
        .help = "horizontal field of view of the wall, degrees",
        .limits = Range{1, 170}},
       {.flag = "--buffers",
        .value = &o.buffers,
        .help = "of loose coupling",
        .limits = Range{1, double(wire::kMaxBuffers)}},
       {.flag = "--seconds",
        .value = &o.seconds,
        .help = "measured for each number of samplers and viewers",
        .limits = Range{0.5, 600}},
       {.flag = "!--no-computed", .value = &o.computed, .help = "leave out the runs in which everything computes"},
       {.flag = "!--no-simulated", .value = &o.simulated, .help = "leave out the runs with simulated nodes"},
       {.flag = "--out", .value = &o.out, .help = "folder for tables and the runs' records"}},
      options::without(std::move(shown), {"--lighting", "--series-rate"}));
}

int bench_volume(VolumeBenchOptions o, const options::Given&) {
  log::initialise("bench", "warn");
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return tools::complain(size.error());
  if (!o.data.scene.empty())
    if (const auto found = data::find_volume(o.data.scene, o.data.volume); !found)
      return tools::complain(found.error());
  std::error_code error;
  fs::create_directories(o.out, error);
  if (error) return tools::complain({fmt::format("{}: cannot be made: {}", o.out, error.message())});
  net::install_signal_handlers();
  if (const Status s = VolumeStudy(o, size->first, size->second).run(); !s) return tools::complain(s.error(), 1);
  std::printf("\nrecord: %s (volume.md, volume.csv)\n", o.out.c_str());
  return 0;
}

}  // namespace

Command bench_volume_command() {
  return make_command(
      "volume",
      "how fast views of a volume are made with 1-4 samplers and 1-4 viewers, beside tables 7.3 and 7.4 of the thesis",
      table, bench_volume);
}

}  // namespace telesplat::launcher
