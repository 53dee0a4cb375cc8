#include "tools/telesplat/bench/volume.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <thread>

#include "common/core/clock.h"
#include "common/geometry/trajectory.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "common/volume/session.h"
#include "tools/make_volume/tree.h"
#include "tools/telesplat/bench/processes.h"
#include "tools/telesplat/bench/volume_report.h"
#include "tools/telesplat/bench/wall.h"
#include "tools/telesplat/progress_line.h"
#include "tools/telesplat/record/csv_line.h"
#include "tools/telesplat/run/pipeline.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr int kRepeat = 3;         // times that a simulated sampler computes a view before it repeats it
constexpr int kWarmViews = 12;     // of each viewer, before anything is measured
constexpr double kSettle_s = 0.5;  // left out at both ends of what is measured
constexpr double kDataPatience_s = 300, kPatience_s = 60;

double mean_of(const std::vector<double>& v) {
  return v.empty() ? 0 : std::accumulate(v.begin(), v.end(), 0.0) / double(v.size());
}

// Some columns of a CSV file that this program's own processes wrote: name -> values; texts that are no numbers are 0, `text` keeps them.
struct Columns {
  std::map<std::string, std::vector<double>> numbers;
  std::vector<std::string> text;
};
Result<Columns> read_columns(const std::string& path, const std::vector<std::string>& names,
                             const std::string& text_name = {}) {
  std::ifstream in(path);
  std::string line;
  if (!std::getline(in, line)) return Error{path + ": cannot be read"};
  const auto header = csv_fields(line).value_or(std::vector<std::string>{});
  const auto column = [&](const std::string& name) {
    return size_t(std::find(header.begin(), header.end(), name) - header.begin());
  };
  for (const auto& name : names)
    if (column(name) == header.size()) return Error{fmt::format("{}: has no column {}", path, name)};
  Columns out;
  while (std::getline(in, line)) {
    const auto fields = csv_fields(line);
    if (!fields || fields->size() != header.size()) continue;
    for (const auto& name : names) out.numbers[name].push_back(std::strtod((*fields)[column(name)].c_str(), nullptr));
    if (const size_t at = column(text_name); at < header.size()) out.text.push_back((*fields)[at]);
  }
  return out;
}

// Medians over the slabs that were leased in [from_s, to_s) of the master's clock.
Status add_slab_times(const std::string& directory, double from_s, double to_s, VolumePoint& point) {
  const auto tiles =
      read_columns(directory + "/tiles.csv", {"leased_s", "sample_begin_s", "encode_end_s", "receive_s", "packed_s"});
  if (!tiles) return tiles.error();
  std::vector<double> sampling, packing;
  const auto& n = tiles->numbers;
  if (n.empty()) return ok_status();
  for (size_t i = 0; i < n.at("leased_s").size(); ++i) {
    if (n.at("leased_s")[i] < from_s || n.at("leased_s")[i] >= to_s) continue;
    sampling.push_back(1e3 * (n.at("encode_end_s")[i] - n.at("sample_begin_s")[i]));
    packing.push_back(1e3 * (n.at("packed_s")[i] - n.at("receive_s")[i]));
  }
  point.sampling_ms = metrics::distribution(sampling).median;
  point.packing_ms = metrics::distribution(packing).median;
  return ok_status();
}

class VolumeStudy {
 public:
  VolumeStudy(const VolumeBenchOptions& o, int width, int height) : options_(o), width_(width), height_(height) {
    report_.size = o.size;
    report_.cores = int(std::max(1u, std::thread::hardware_concurrency()));
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
    path_ = options_.volume;
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
    RunOptions o;
    o.scene = path_;
    o.kind = SceneKind::kVolume;
    o.volume = options_.data;
    o.series_rate = "0";
    o.samplers = samplers;
    o.viewers = viewers;
    if (viewers > 1) o.wall = fmt::format("{}x1", viewers);
    o.sampler_threads = 1;
    o.viewer.size = fmt::format("{}x{}", width_ / viewers, height_);
    o.viewer.sampling_size = o.viewer.size;
    o.viewer.trajectory = "still";
    o.viewer.coupling = "loose";
    o.viewer.buffers = options_.buffers;
    o.viewer.display.fov_deg = options_.fov_deg;
    o.viewer.display.target_fps = 0;
    o.viewer.display.duration_s = options_.seconds + 2 * kSettle_s;
    o.viewer.display.picture_every = 0;
    o.viewer.record_points_mb = 0;
    o.out = fmt::format("{}/computed-{}x{}", options_.out, samplers, viewers);
    o.master.service.log_level = "warn";
    o.started_s = monotonic_s();
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
      progress_.show(fmt::format("computed: {} sampler(s), {} viewer(s) {}", samplers, viewers, pipeline->progress()));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    pipeline->finish();
    if (state != Pipeline::State::kFinished) return Error{fmt::format("the run failed; see {}/logs", o.out)};

    VolumePoint point{false, samplers, viewers};
    const auto frames = read_columns(o.out + "/frames.csv", {"t_s", "construction_ms"}, "viewer");
    if (!frames) return frames.error();
    std::map<std::string, std::vector<double>> shown;
    std::vector<double> construction;
    for (size_t i = 0; i < frames->text.size(); ++i) {
      const double t = frames->numbers.at("t_s")[i];
      if (t < kSettle_s || t > kSettle_s + options_.seconds) continue;
      shown[frames->text[i]].push_back(t);
      construction.push_back(frames->numbers.at("construction_ms")[i]);
    }
    std::vector<double> rates;
    for (const auto& [viewer, t] : shown) rates.push_back(double(t.size()) / options_.seconds);
    rates.resize(size_t(viewers));  // one that showed nothing counts, too
    point.fps = mean_of(rates);
    point.least_fps = *std::min_element(rates.begin(), rates.end());
    point.construction_ms = metrics::distribution(construction).median;
    const auto updates = read_columns(o.out + "/updates.csv", {"bytes"});
    if (updates && updates->numbers.contains("bytes")) point.bytes_per_frame = mean_of(updates->numbers.at("bytes"));
    if (const Status s = add_slab_times(o.out, 0, 1e18, point); !s) return s;
    add(point);
    return ok_status();
  }

  Status simulated(int samplers) {
    std::vector<std::string> data{path_, "--lighting", options_.data.lit ? "on" : "off", "--series-rate", "0"};
    if (!options_.data.raw.empty()) data.insert(data.end(), {"--raw", options_.data.raw});
    if (!options_.data.transfer.empty()) data.push_back("--tf=" + options_.data.transfer);
    const std::string directory = fmt::format("{}/simulated-{}", options_.out, samplers);
    std::error_code error;
    fs::remove_all(directory, error);
    auto processes = BenchProcesses::start(data, {}, directory, true);
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

  Status simulated_wall(BenchProcesses& processes, VolumePoint& point, double& from_s, double& to_s) {
    const auto whole = geometry::make_camera(geometry::default_pose(), options_.fov_deg, width_, height_);
    net::Context context;
    std::vector<std::unique_ptr<WaitingViewer>> wall;
    for (int i = 0; i < point.viewers; ++i)
      wall.push_back(std::make_unique<WaitingViewer>(context, processes.endpoint(), fmt::format("viewer-{}", i + 1),
                                                     geometry::crop(whole, tile(point.viewers, i)), options_.buffers));
    std::vector<double> costs(wall.size(), 1e-3);
    // Turns until `done`, each viewer as often as it needs.
    const auto go_on = [&](bool asks, double patience_s, const auto& done) -> Status {
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
    };
    progress_.show(fmt::format("simulated: {} sampler(s), {} viewer(s)", point.samplers, point.viewers));
    Status s = go_on(true, kPatience_s, [&] {
      return std::all_of(wall.begin(), wall.end(), [](const auto& v) { return v->shown_s().size() >= kWarmViews; });
    });
    if (!s) return s;
    s = go_on(false, kPatience_s,
              [&] { return std::all_of(wall.begin(), wall.end(), [](const auto& v) { return v->open() == 0; }); });
    if (!s) return s;

    std::vector<double> bytes;
    for (size_t i = 0; i < wall.size(); ++i) {
      const auto session = volume::read_session(wall[i]->session()->parameters, wall[i]->session()->facts);
      if (!session) return session.error();
      const auto cost = measure_view(*wall[i]->newest(), session->grid, wall[i]->camera(), 5);
      if (!cost) return cost.error();
      costs[i] = cost->total_s();
      bytes.push_back(double(cost->bytes));
    }
    const double begin_s = monotonic_s() + kSettle_s, end_s = begin_s + options_.seconds;
    s = go_on(true, kPatience_s + options_.seconds, [&] { return monotonic_s() > end_s; });
    if (!s) return s;
    std::vector<double> rates;
    for (const auto& v : wall)
      rates.push_back(double(std::count_if(v->shown_s().begin(), v->shown_s().end(),
                                           [&](double t) { return t >= begin_s && t < end_s; })) /
                      options_.seconds);
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
  ProgressLine progress_;
};

int refuse(const std::string& why) {
  std::fprintf(stderr, "telesplat: %s\n", why.c_str());
  return 2;
}

}  // namespace

void add_volume_bench_flags(CLI::App& app, VolumeBenchOptions& o) {
  app.add_option("--volume", o.volume, "volume to show; without it a made-up one of --generated voxels a side");
  app.add_option("--generated", o.generated_side, "voxels a side of the made-up volume")
      ->capture_default_str()
      ->check(CLI::Range(made_volume::kMinSide, made_volume::kMaxSide));
  app.add_option("--raw", o.data.raw, "as --raw of run");
  app.add_option("--tf", o.data.transfer, "as --tf of run");
  app.add_flag("!--unlit", o.data.lit, "do not shade voxels");
  app.add_option("--samplers", o.samplers, "numbers of samplers")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  app.add_option("--viewers", o.viewers, "numbers of viewers")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(1, kMaxViewers));
  app.add_option("--size", o.size, "pixels of the wall that the viewers share, WxH")->capture_default_str();
  app.add_option("--fov", o.fov_deg, "horizontal field of view of the wall, degrees")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 170.0));
  app.add_option("--buffers", o.buffers, "of loose coupling")
      ->capture_default_str()
      ->check(CLI::Range(1, int(wire::kMaxBuffers)));
  app.add_option("--seconds", o.seconds, "measured for each number of samplers and viewers")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 600.0));
  app.add_flag("!--no-computed", o.computed, "leave out the runs in which everything computes");
  app.add_flag("!--no-simulated", o.simulated, "leave out the runs with simulated nodes");
  app.add_option("--out", o.out, "folder for tables and the runs' records")->capture_default_str();
}

int bench_volume(const VolumeBenchOptions& o) {
  log::initialise("bench", "warn");
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return refuse(size.error().text);
  if (!o.volume.empty())
    if (const auto found = data::find_volume(o.volume, o.data.raw); !found) return refuse(found.error().text);
  std::error_code error;
  fs::create_directories(o.out, error);
  if (error) return refuse(fmt::format("{}: cannot be made: {}", o.out, error.message()));
  net::install_signal_handlers();
  if (const Status s = VolumeStudy(o, size->first, size->second).run(); !s) {
    std::fprintf(stderr, "telesplat: %s\n", s.error().text.c_str());
    return 1;
  }
  std::printf("\nrecord: %s (volume.md, volume.csv)\n", o.out.c_str());
  return 0;
}

}  // namespace telesplat::launcher
