// Plans the rays of views: owns the planner of the model, and measures how long it takes.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/metrics/recorder.h"
#include "services/packer/packing.h"
#include "services/packer/points/packer_core.h"
#include "services/packer/points/plan/planner.h"

namespace telesplat::packer {

class Planning {
 public:
  /// Keeps references to both.
  Planning(const Outlets& outlets, metrics::SpanRecorder& spans) : outlets_(outlets), spans_(spans) {}

  /// Null: there is no model yet, or redundant points are kept.
  Planner* planner() const { return planner_.get(); }
  /// The model is another.
  void drop() { planner_.reset(); }
  /// The planner watches this model. Another configuration means another planner, which knows what the model knows.
  void follow(PackerCore& core, const PlanConfig& config) {
    if (core.redundancy() == Redundancy::kKeep) return core.watch(nullptr), planner_.reset();
    if (planner_ && config_ == config) return;
    config_ = config;
    planner_ = std::make_unique<Planner>(config);
    planner_->learn(core.model());
    core.watch(planner_.get());
  }
  /// Planner::plan_piece(). Precondition: planner().
  std::optional<wire::Plan> piece(const PackerCore& core, const wire::PlanRequest& request, double now_s) {
    const double begin_s = monotonic_s(), begin_master_s = outlets_.master_now();
    auto plan = planner_->plan_piece(core.model(), core.sequence(), request, now_s);
    spans_.add("plan", begin_master_s, outlets_.master_now(), 0,
               {.frame = double(request.frame.value), .request = double(request.request.value)});
    double took_s = monotonic_s() - begin_s;
    if (request.extra) {
      if (std::exchange(frame_, request.frame) == request.frame) took_s += frame_took_s_;
      frame_took_s_ = took_s;
    }
    if (!plan) return std::nullopt;
    plan->figures["plan_ms"] = took_s * 1e3;
    ++plans_;
    const uint64_t pixels = uint64_t(request.camera.width) * uint64_t(request.camera.height);
    if (pixels > Planner::kMaxPixels && !std::exchange(told_of_size_, true))
      log::warn("views of {}x{} pixels are sampled whole: up to {} pixels are planned", request.camera.width,
                request.camera.height, Planner::kMaxPixels);
    return plan;
  }
  /// Planner::settle(). False: there was nothing to do. Messages wait meanwhile, so it may take a quarter of the time
  /// at most, unless it saves more than it takes.
  bool settle(double now_s) {
    constexpr double kPause = 3;
    if (!planner_ || (now_s < next_settle_s_ && !planner_->settles_soon())) return false;
    const double begin_s = outlets_.master_now(), started_s = monotonic_s();
    if (!planner_->settle()) return false;
    next_settle_s_ = now_s + (1 + kPause) * (monotonic_s() - started_s);
    spans_.add("settle", begin_s, outlets_.master_now());
    return true;
  }
  uint64_t plans() const { return plans_; }

 private:
  const Outlets& outlets_;
  metrics::SpanRecorder& spans_;
  std::unique_ptr<Planner> planner_;
  PlanConfig config_;  // the planner's
  uint64_t plans_ = 0;
  FrameId frame_;              // frame whose extra rays are being planned
  double frame_took_s_ = 0;    // time spent on it so far
  bool told_of_size_ = false;  // logged that views are too large for plans
  double next_settle_s_ = 0;
};

}  // namespace telesplat::packer
