#include "tools/telesplat/bench/tracking/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <tuple>

#include "client/viewer/tracking/rotation.h"
#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

constexpr double kWarmUp_s = 0.5, kDegrees = 180 / 3.14159265358979323846;
constexpr size_t kMethods = tracking::kPredictionNames.size();

/// What one horizon came to: errors of each way, a value a pose.
struct Errors {
  std::vector<double> mm[kMethods], deg[kMethods];

  void add(const Errors& other) {
    for (size_t m = 0; m < kMethods; ++m) {
      mm[m].insert(mm[m].end(), other.mm[m].begin(), other.mm[m].end());
      deg[m].insert(deg[m].end(), other.deg[m].begin(), other.deg[m].end());
    }
  }
};

std::vector<geometry::Trajectory::Sample> told(const Movement& movement, double rate_hz) {
  if (rate_hz <= 0) return movement.samples;
  const auto recorded = geometry::Trajectory::of(movement.samples);
  std::vector<geometry::Trajectory::Sample> out;
  for (size_t i = 0; double(i) / rate_hz <= recorded.duration_s(); ++i)
    out.push_back({double(i) / rate_hz, recorded.at(double(i) / rate_hz)});
  return out;
}

std::vector<Errors> errors_of(const Movement& movement, const std::vector<int>& horizons_ms, double rate_hz,
                              const std::function<bool()>& go_on) {
  std::vector<Errors> out(horizons_ms.size());
  const auto samples = told(movement, rate_hz);
  const auto actual = geometry::Trajectory::of(movement.samples);
  const double begin_s = samples.front().t_s, end_s = movement.samples.back().t_s - movement.samples.front().t_s;
  tracking::PosePredictor predictors[kMethods];
  for (size_t m = 0; m < kMethods; ++m) predictors[m] = tracking::PosePredictor(tracking::Prediction(m));
  for (size_t i = 0; i < samples.size() && (i % 1024 || go_on()); ++i) {
    const double t_s = samples[i].t_s - begin_s;
    for (auto& p : predictors) p.add(t_s, samples[i].pose);
    if (t_s < kWarmUp_s) continue;
    for (size_t h = 0; h < horizons_ms.size(); ++h) {
      const double for_s = t_s + horizons_ms[h] * 1e-3;
      if (for_s > end_s) continue;
      const geometry::Pose there = actual.at(for_s);
      for (size_t m = 0; m < kMethods; ++m) {
        const geometry::Pose expected = predictors[m].predict(for_s);
        out[h].mm[m].push_back(glm::distance(expected.position_room, there.position_room) * 1e3);
        out[h].deg[m].push_back(tracking::angle_between(expected.orientation, there.orientation) * kDegrees);
      }
    }
  }
  return out;
}

TrackingRow row_of(const std::string& name, int horizon_ms, const Errors& errors) {
  TrackingRow out{name, horizon_ms, errors.mm[0].size(), {}};
  for (size_t m = 0; m < kMethods; ++m) {
    const auto mm = metrics::distribution(errors.mm[m]), deg = metrics::distribution(errors.deg[m]);
    out.by_method.push_back({mm.mean, mm.p95, deg.mean, deg.p95});
  }
  return out;
}

std::string share(double value, double of) { return of > 0 ? fmt::format("{:.2f}", value / of) : "-"; }

}  // namespace

std::vector<TrackingRow> measure_tracking(const std::vector<Movement>& movements, const std::vector<int>& horizons_ms,
                                          double rate_hz, const std::function<bool()>& go_on) {
  std::vector<TrackingRow> out;
  std::vector<Errors> all(horizons_ms.size());
  for (const Movement& movement : movements) {
    const auto errors = errors_of(movement, horizons_ms, rate_hz, go_on);
    for (size_t h = 0; h < horizons_ms.size(); ++h) {
      out.push_back(row_of(movement.name, horizons_ms[h], errors[h]));
      all[h].add(errors[h]);
    }
  }
  if (movements.size() > 1)
    for (size_t h = 0; h < horizons_ms.size(); ++h) out.push_back(row_of("all", horizons_ms[h], all[h]));
  return out;
}

std::string to_markdown(const std::vector<TrackingRow>& rows) {
  std::string out =
      "| movement | horizon, ms | none, mm | velocity / none | kalman / none | none, degrees | velocity / none | "
      "kalman / none |\n|---|---|---|---|---|---|---|---|\n";
  for (const TrackingRow& row : rows) {
    const auto& [none, velocity, kalman] = std::tie(row.by_method[0], row.by_method[1], row.by_method[2]);
    out += fmt::format("| {} | {} | {:.1f} | {} | {} | {:.2f} | {} | {} |\n", row.file, row.horizon_ms, none.mean_mm,
                       share(velocity.mean_mm, none.mean_mm), share(kalman.mean_mm, none.mean_mm), none.mean_deg,
                       share(velocity.mean_deg, none.mean_deg), share(kalman.mean_deg, none.mean_deg));
  }
  return out;
}

Status write_csv(const std::vector<TrackingRow>& rows, const std::string& path) {
  std::ofstream out(path);
  out << "movement,horizon_ms,prediction,poses,mean_mm,p95_mm,mean_deg,p95_deg\n";
  for (const TrackingRow& row : rows)
    for (size_t m = 0; m < kMethods; ++m) {
      const TrackingFigures& f = row.by_method[m];
      out << fmt::format("{},{},{},{},{:.4f},{:.4f},{:.4f},{:.4f}\n", row.file, row.horizon_ms,
                         tracking::kPredictionNames[m], row.poses, f.mean_mm, f.p95_mm, f.mean_deg, f.p95_deg);
    }
  out.close();
  return out ? ok_status() : Status(Error{fmt::format("{}: cannot be written", path)});
}

}  // namespace telesplat::launcher
