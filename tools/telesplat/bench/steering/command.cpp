// `telesplat bench steering`: what steered sampling saves and what it costs. A walk through real scenes, steering off
// and on side by side, without waiting for real time.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <tuple>

#include "client/viewer/viewer_service.h"
#include "common/core/log.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/bench/bench_commands.h"
#include "tools/telesplat/bench/steering/comparison.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

Result<std::vector<ModeReport>> run_scene(const SteeringBenchOptions& o, const std::string& name, const Walk& walk,
                                          std::pair<int, int> size, const TimingConfig& timing) {
  data::DataOptions data = o.data;
  data.scene = name;
  const auto scene = scene_of(data);
  if (!scene) return scene.error();
  tools::ProgressLine progress;
  auto direct = (*scene)->open_direct(o.threads, [&](const char* stage, double fraction) {
    progress.show(fmt::format("{}: {} {:.0f} %", name, stage, 100 * fraction));
  });
  progress.close();
  if (!direct) return direct.error();
  SteeringComparison comparison(o, (*scene)->name(), **direct, walk, size, timing);
  return comparison.run(
      [&](double t, double of) { progress.show(fmt::format("{}: {:.1f} of {:.0f} s", name, t, of)); });
}

Result<TimingConfig> timing_of(const SteeringBenchOptions& o) {
  TimingConfig out{o.cores, o.latency_s, o.rays_per_s, {}};
  out.requests.max_rate_hz = o.views_per_s;
  out.requests.adaptive = o.sampling_size == "auto";
  if (out.requests.adaptive) return out;
  const auto size = viewer::parse_size(o.sampling_size, "--sampling-size");
  if (!size) return size.error();
  std::tie(out.requests.sampling_width, out.requests.sampling_height) = *size;
  return out;
}

int bench_steering(SteeringBenchOptions o, const options::Given&) {
  net::install_signal_handlers();
  log::initialise("telesplat", "warn");
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return tools::complain(size.error());
  if (o.scenes.empty()) return tools::complain({"which scene? name meshes, or julia"});
  if (const Status s = check_modes(o.modes); !s) return tools::complain(s.error());
  if (const Status s = image::validate_samples(o.reference_samples); !s)
    return tools::complain({fmt::format("--reference-samples {}", s.error().text)});
  const auto timing = timing_of(o);
  if (!timing) return tools::complain(timing.error());
  const auto walk = Walk::open(o.trajectory);
  if (!walk) return tools::complain(walk.error());
  std::error_code error;
  if (!o.out.empty() && !(std::filesystem::create_directories(o.out, error), std::filesystem::is_directory(o.out)))
    return tools::complain({fmt::format("--out {}: cannot be made: {}", o.out, error.message())});
  std::vector<ModeReport> reports;
  for (const std::string& name : o.scenes) {
    data::DataOptions data = o.data;
    data.scene = name;
    if (const auto scene = scene_of(data); !scene) return tools::complain(scene.error());
    auto some = run_scene(o, name, *walk, *size, *timing);
    if (!some) return tools::complain(some.error(), 1);
    for (ModeReport& r : *some) reports.push_back(std::move(r));
    if (!o.out.empty())
      if (const Status s = write_report(reports, o.out); !s) return tools::complain(s.error(), 1);
  }
  std::printf("%s", to_markdown(reports).c_str());
  return net::stop_requested() ? tools::complain({"told to stop"}, 1) : 0;
}

}  // namespace

Command bench_steering_command() {
  return make_command("steering", "rays that steered sampling saves along a walk, and what views lose or gain by it",
                      table, bench_steering);
}

}  // namespace telesplat::launcher
