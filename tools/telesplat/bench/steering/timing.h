// When things happen in `telesplat bench steering`: a viewer asks for views as in a session, samplers and packer take
// the time that their work took.
#pragma once

#include <optional>

#include "client/viewer/coupling/view_requester.h"
#include "tools/telesplat/bench/steering/session.h"

namespace telesplat::launcher {

struct TimingConfig {
  double cores = 1;         ///< that share the work of samplers and packer; 0: each view takes latency_s
  double latency_s = 0.1;   ///< of each view, if there are no cores
  double rays_per_s = 4e6;  ///< in that case: how long extra frames take
  viewer::RequestOptions requests;
};

/// One session on a clock of its own.
class TimedSession {
 public:
  /// Sampled whole beside its plan, to count what the plan misses; or nothing.
  using Audit = std::function<Result<image::DepthImage>(const geometry::Camera&)>;

  TimedSession(std::unique_ptr<SteeredSession> session, const TimingConfig& config, Audit audit);

  /// The display shows `camera` at t_s, which rises from call to call. What is complete by then is in the session
  /// afterwards.
  Status display(double t_s, const geometry::Camera& camera);

  SteeredSession& session() { return *session_; }
  const std::vector<ViewCost>& views() const { return views_; }
  const wire::ViewRequest* newest() const { return newest_ ? &*newest_ : nullptr; }

 private:
  void settle(double t_s);
  Status finish_view();
  Status extra_frames(double t_s);
  double seconds(const ViewCost& cost) const;

  std::unique_ptr<SteeredSession> session_;
  TimingConfig config_;
  Audit audit_;
  viewer::ViewRequester requester_;
  std::vector<ViewCost> views_;
  std::optional<wire::ViewRequest> waiting_, open_, newest_;  // waiting: for the open one to be complete
  double began_s_ = 0, expected_s_;                           // of the open view: its work
  double settled_s_ = 0, next_settle_s_ = 0;  // when the packer is done with what it learns, and learns again
  double busy_until_s_ = 0;                   // by extra frames
};

}  // namespace telesplat::launcher
