// `telesplat bench tracking FILE...`: how well each way of predicting a head does, on recorded movements.
#include <cstdio>
#include <filesystem>

#include "common/core/log.h"
#include "common/geometry/trajectory_file.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/telesplat/bench/bench_commands.h"
#include "tools/telesplat/bench/number_list.h"
#include "tools/telesplat/bench/tracking/report.h"

namespace telesplat::launcher {
namespace {

struct TrackingOptions {
  std::vector<std::string> files;
  std::vector<int> horizons_ms{20, 40, 60, 80, 100};
  double rate_hz = 0;
  std::string csv;
};

options::Table table(TrackingOptions& o) {
  return {{.flag = "files",
           .value = &o.files,
           .help = "recorded head movements: CSV files with the columns t_s, px, py, pz, qw, qx, qy, qz",
           .required = true},
          {.flag = "--horizons",
           .value = number_list(o.horizons_ms, 1, 1000),
           .help = "milliseconds that poses are predicted ahead"},
          {.flag = "--rate",
           .value = &o.rate_hz,
           .help = "poses a second that predictors are told, interpolated; 0: as recorded",
           .limits = options::Range{0, 10'000}},
          {.flag = "--csv", .value = &o.csv, .help = "file for the table, with 95th percentiles"}};
}

int bench_tracking(TrackingOptions o, const options::Given&) {
  log::initialise("bench", "warn");
  net::install_signal_handlers();
  std::vector<Movement> movements;
  for (const auto& file : o.files) {
    auto samples = geometry::read_samples(file);
    if (!samples) return tools::complain(samples.error());
    movements.push_back({std::filesystem::path(file).stem().string(), std::move(*samples)});
  }
  const auto rows = measure_tracking(movements, o.horizons_ms, o.rate_hz, [] { return !net::stop_requested(); });
  if (net::stop_requested()) {
    tools::complain({"interrupted"});
    return 130;
  }
  std::fputs(to_markdown(rows).c_str(), stdout);
  if (o.csv.empty()) return 0;
  const Status written = write_csv(rows, o.csv);
  return written ? 0 : tools::complain(written.error(), 1);
}

}  // namespace

Command bench_tracking_command() {
  return make_command("tracking",
                      "how well heads are predicted on recorded movements: not at all, by velocity, by a Kalman filter",
                      table, bench_tracking);
}

}  // namespace telesplat::launcher
