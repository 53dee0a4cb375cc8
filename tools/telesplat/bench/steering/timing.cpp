#include "tools/telesplat/bench/steering/timing.h"

#include <algorithm>

namespace telesplat::launcher {
namespace {

constexpr double kMessages_s = 0.012;  // from process to process, and to the next displayed frame

}  // namespace

TimedSession::TimedSession(std::unique_ptr<SteeredSession> session, const TimingConfig& config, Audit audit)
    : session_(std::move(session)),
      config_(config),
      audit_(std::move(audit)),
      requester_(config.requests, SteeredSession::kViewer),
      expected_s_(config.cores > 0 ? config.requests.initial_latency_s : config.latency_s) {
  requester_.set_steered(session_->steering());
}

double TimedSession::seconds(const ViewCost& c) const {
  if (config_.cores <= 0) return config_.latency_s;
  return kMessages_s +
         1e-3 * (c.plan_ms + c.sample_cpu_ms + c.encode_cpu_ms + c.pack_cpu_ms + c.insert_cpu_ms) / config_.cores;
}

Status TimedSession::display(double t_s, const geometry::Camera& camera) {
  requester_.on_pose(t_s, camera);
  // How long a view takes is known only once its work is done; it is done when as long has passed as the view before
  // took.
  if (open_ && t_s >= began_s_ + expected_s_)
    if (const Status s = finish_view(); !s) return s;
  settle(t_s);
  if (auto request = requester_.next(t_s)) waiting_ = std::move(request);
  if (!open_ && waiting_) {
    // Extra frames that are open are dropped; a step of what the packer learns is not.
    began_s_ = std::max(t_s, settled_s_);
    open_ = std::move(waiting_);
    waiting_.reset();
  }
  return open_ ? ok_status() : extra_frames(t_s);
}

// As the packer does it: in a quarter of the time at most.
void TimedSession::settle(double t_s) {
  constexpr double kPause = 3;
  if (views_.empty() || t_s < next_settle_s_) return;
  double ms = 0;
  do {
    ms = session_->settle();
    views_.back().settle_cpu_ms += ms;
  } while (ms > 0 && config_.cores <= 0);
  const double took_s = config_.cores > 0 ? 1e-3 * ms / config_.cores : 0;
  settled_s_ = std::max(settled_s_, t_s + took_s);
  next_settle_s_ = t_s + (1 + kPause) * took_s;
}

Status TimedSession::finish_view() {
  const wire::ViewRequest request = *open_;
  open_.reset();
  newest_ = request;
  std::optional<image::DepthImage> whole;
  if (audit_) {
    auto sampled = audit_(request.camera);
    if (!sampled) return sampled.error();
    whole = std::move(*sampled);
  }
  auto cost = session_->view(began_s_, request.camera, request.footprint, whole ? &*whole : nullptr);
  if (!cost) return cost.error();
  expected_s_ = seconds(*cost);
  cost->requested_s = request.moments.requested_s;
  cost->complete_s = began_s_ + expected_s_;
  requester_.on_part({.viewer = SteeredSession::kViewer,
                      .request = request.request,
                      .epoch = SteeredSession::kEpoch,
                      .frame = cost->frame,
                      .complete = true,
                      .tiles = std::max<uint64_t>(cost->tiles, 1),
                      .points = cost->kept,
                      .samples = cost->samples,
                      .bytes = cost->sent_bytes,
                      .camera = request.camera,
                      .eliminated = cost->samples - std::min(cost->kept, cost->samples)},
                     cost->complete_s);
  busy_until_s_ = cost->complete_s;
  views_.push_back(std::move(*cost));
  return ok_status();
}

// As long as samplers have nothing else to do.
Status TimedSession::extra_frames(double t_s) {
  while (!views_.empty() && busy_until_s_ <= t_s && !session_->exhausted()) {
    const double rays_per_s = config_.cores > 0 ? session_->rays_per_cpu_s() * config_.cores : config_.rays_per_s;
    const auto extra = session_->extra(t_s, uint64_t(std::max(1.0, rays_per_s * SteeredSession::kExtra_s)));
    if (!extra) return extra.error();
    busy_until_s_ += config_.cores > 0 ? seconds(*extra) : double(extra->rays) / std::max(config_.rays_per_s, 1.0);
    views_.back().add_extra(*extra);
  }
  return ok_status();
}

}  // namespace telesplat::launcher
