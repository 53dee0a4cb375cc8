#include "client/viewer/worker/viewer_meter.h"

#include <fmt/format.h>

#include <utility>

#include "common/core/clock.h"

namespace telesplat::viewer {

void ViewerMeter::completed(double now_s, double latency_ms) {
  latency_ms_ = latency_ms;
  ++updates_;
  latencies_ms_.add(now_s, latency_ms);
}

void ViewerMeter::on_first_points(double now_s) {
  if (first_points_s_ == 0) first_points_s_ = now_s - started_s_;
}

void ViewerMeter::displayed(EpochId epoch) {
  ++frames_;
  if (const uint64_t before = epoch_.exchange(epoch.value); before != 0 && before != epoch.value) ++epochs_;
}

void ViewerMeter::measured(const MeasuredFrame& f) {
  if (const double gap_ms = f.inter_frame_ms(); f.previous_s > 0) {
    inter_frame_ms_.add(f.end_s, gap_ms);
    if (gap_ms > longest_gap_ms_) longest_gap_ms_ = gap_ms;  // safe: only one thread displays
  }
  update_age_ms_.add(f.end_s, f.update_age_s * 1e3);
}

void ViewerMeter::add_figures(SessionFigures& figures) const {
  figures.updates = updates_;
  figures.latency_ms = latency_ms_;
  figures.bytes_received = bytes_;
  figures.epochs_shown = epochs_;
}

void ViewerMeter::add_status(net::MasterLink::Values& values) const {
  values["bytes_received"] = double(bytes_);
  values["updates"] = double(updates_);
  values["frames"] = double(frames_);
  values["first_points_s"] = first_points_s_;
  values["epochs_shown"] = double(epochs_);
  values["epoch"] = double(epoch_);
  values["waits_s"] = waits_s_;
  values["longest_gap_ms"] = longest_gap_ms_;
}

void ViewerMeter::add_recent(net::MasterLink::Values& values) const {
  const double now_s = monotonic_s();
  for (const auto& [name, recent] : {std::pair{"inter_frame", &inter_frame_ms_},
                                     {"update_latency", &latencies_ms_},
                                     {"update_age", &update_age_ms_}}) {
    const auto figures = recent->figures(now_s);
    if (figures.count == 0) continue;
    values[fmt::format("{}_ms", name)] = figures.median;
    values[fmt::format("{}_p95_ms", name)] = figures.p95;
  }
}

}  // namespace telesplat::viewer
