// Figures of a viewer that people watch: what came, what was displayed, and how soon.
#pragma once

#include <atomic>

#include "client/viewer/display/frame_figures.h"
#include "client/viewer/record/recent_values.h"
#include "common/net/master_link.h"

namespace telesplat::viewer {

/// Thread-safe.
class ViewerMeter {
 public:
  /// started_s: the session's start, monotonic clock.
  explicit ViewerMeter(double started_s) : started_s_(started_s) {}

  void received(uint64_t bytes) { bytes_ += bytes; }
  void completed(double now_s, double latency_ms);
  /// Something of the scene was displayed. Later calls change nothing.
  void on_first_points(double now_s);
  void displayed(EpochId epoch);
  void measured(const MeasuredFrame& frame);
  /// The display has waited this long for a view update, s; 0: it does not wait.
  void waits(double waits_s) { waits_s_ = waits_s; }

  uint64_t updates() const { return updates_; }
  void add_figures(SessionFigures& figures) const;
  void add_status(net::MasterLink::Values& values) const;
  /// Adds medians and 95th percentiles of the last kRecent_s.
  void add_recent(net::MasterLink::Values& values) const;

 private:
  static constexpr double kRecent_s = 5;
  const double started_s_;
  std::atomic<uint64_t> updates_{0}, bytes_{0}, frames_{0}, epochs_{0}, epoch_{0};
  std::atomic<double> first_points_s_{0}, waits_s_{0}, latency_ms_{0};
  std::atomic<double> longest_gap_ms_{0};  // between two displayed frames
  RecentValues inter_frame_ms_{kRecent_s}, update_age_ms_{kRecent_s}, latencies_ms_{kRecent_s};
};

}  // namespace telesplat::viewer
