// The packer's part for points (T4.3): depth tiles come in, point-model events go out, late joiners get the events that
// they lack.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "common/core/ids.h"
#include "common/core/log.h"
#include "common/geometry/camera.h"
#include "common/metrics/process.h"
#include "common/metrics/recorder.h"
#include "common/net/connections/peer_rates.h"
#include "services/packer/packing.h"
#include "services/packer/points/block_gatherer.h"
#include "services/packer/points/depth_recorder.h"
#include "services/packer/points/event_log.h"
#include "services/packer/points/link_meter.h"
#include "services/packer/points/packer_core.h"
#include "services/packer/points/plan/planner.h"
#include "services/packer/points/state_answers.h"

namespace telesplat::packer {

// Decides whether all heads stand still. No clocks.

class StillHeads {
 public:
  static constexpr double kStill_s = 0.3;      ///< a head that has not moved for this long stands still
  static constexpr double kSilence_s = 10;     ///< a viewer without requests for this long does not count
  static constexpr double kMove_m = 2e-3;      ///< tremble of trackers is less
  static constexpr double kTurn_rad = 3.5e-3;  ///< 0.2 degrees
  static constexpr size_t kMostViewers = 256;

  /// A viewer asks for a view from this pose.
  void seen(InstanceId viewer, const geometry::Pose& pose, double now_s) {
    if (heads_.size() >= kMostViewers && !heads_.contains(viewer)) return;
    Head& head = heads_.try_emplace(viewer, Head{pose, now_s, now_s}).first->second;
    head.seen_s = now_s;
    const double cosine = std::min(1.0, std::abs(glm::dot(head.pose.orientation, pose.orientation)));
    if (glm::distance(head.pose.position_room, pose.position_room) <= kMove_m && 2 * std::acos(cosine) <= kTurn_rad)
      return;
    head.pose = pose, head.moved_s = now_s;
  }
  /// Returns the time since any head moved, s; without viewers +infinity.
  double still_s(double now_s) {
    std::erase_if(heads_, [&](const auto& h) { return now_s - h.second.seen_s > kSilence_s; });
    double out = std::numeric_limits<double>::infinity();
    for (const auto& [viewer, head] : heads_) out = std::min(out, now_s - head.moved_s);
    return out;
  }
  bool still(double now_s) { return still_s(now_s) >= kStill_s; }

 private:
  struct Head {
    geometry::Pose pose;  // at the last movement
    double moved_s, seen_s;
  };
  std::map<InstanceId, Head> heads_;
};

class PointPacking final : public Packing {
 public:
  static constexpr double kMarkPeriod_s = 0.5;  ///< between two marks, by which viewers notice missed events
  /// Least time between two marks with the model's digest, by which viewers check their replica; and the share of time
  /// that digests may take.
  static constexpr double kDigestPeriod_s = 2.0, kDigestShare = 0.002;
  /// Answers to state requests that a connection may begin per second; twice as many after a quiet time.
  static constexpr double kBeginnings_s = 8;
  static constexpr double kForgetPeriod_s = 1.0;  ///< between two searches for obsolete clusters
  /// Viewers' links are slow below this rate, and no longer slow from 9/8 of it; `auto` error options depend on it.
  static constexpr double kSlowLink_bytes_s = 5e6;
  /// The errors that `auto` allows with slow links.
  static constexpr AllowedErrors kSlowErrors{1.0 / 32, 1, 1};
  /// Refinement: while heads stand still, patches drawn within kDrawnLately_s become exact (viewers report once a
  /// second what they draw), unless a link has more under way than it carries in kRefineBacklog_s, or than
  /// kRefineBytes. kRefineStep bytes at a time, since messages wait meanwhile.
  static constexpr double kDrawnLately_s = 3, kRefineBacklog_s = 0.05, kRefinePause_s = 1;
  /// Rays that views lack go first: patches become exact only when no such rays have come for kQuiet_s, or heads have
  /// stood still for kLongStill_s.
  static constexpr double kQuiet_s = 0.3, kLongStill_s = 10;
  static constexpr uint64_t kRefineBytes = 32 << 10, kRefineStep = 16 << 10;

  struct Options {
    int threads = 1;                    ///< for reference depth maps; 0: all cores
    uint64_t max_log_bytes = 0;         ///< Config::max_log_bytes
    StateAnswers::Limits answers = {};  ///< for viewers that join or have gaps
    DepthRecorder* recorder = nullptr;  ///< records sampled depth images; null: not recorded
  };
  /// Keeps a reference to the spans, and the recorders' addresses.
  PointPacking(const Options& options, Outlets outlets, metrics::SpanRecorder& spans)
      : options_(options), outlets_(std::move(outlets)), spans_(spans), answers_(options.answers) {}

  bool follow(const wire::Welcome& session, double now_s) override;
  void take_sampled(net::Socket& from, const net::Message& message, double now_s) override;
  void take_state(net::Socket& from, const net::Message& message, double now_s) override;
  void end_frame(const wire::FrameEnd& end, double now_s) override;
  wire::Plan plan(const wire::PlanRequest& request, double now_s) override;
  std::optional<wire::Plan> plan_piece(const wire::PlanRequest& request, double now_s) override;
  bool hurried(double now_s) const override { return planner_ && planner_->view_under_way(now_s); }
  bool idle(double now_s) override;
  void tick(double now_s) override;
  std::optional<double> due_s() const override {
    return answers_.can_go_on() || refining_ ? std::optional(0.0) : std::nullopt;
  }
  void add_status(net::MasterLink::Values& values) const override;
  uint64_t points() const { return core_ ? core_->model().points() : 0; }
  /// The model's digest, for tests of replication; 0: no model yet.
  uint64_t digest() const { return core_ ? core_->model().digest() : 0; }

 private:
  struct Received {
    net::Socket* from;
    net::Message message;
    wire::DepthTile tile;  // its image lies in the message
  };
  void begin(const Config& config, const wire::Welcome& session);
  void begin_planner(const PlanConfig& config);
  void pack(const Received& received, double since_s, double now_s);
  void refuse(const Received& received, const std::string& why);
  /// Packs a complete block. stream: of the whole block, if it came as one tile; else null.
  ///     whole: every pixel of the block was cast.
  Status pack_block(SampledTile block, bool whole, std::shared_ptr<const std::vector<uint8_t>> stream,
                    wire::TileDone& done, double now_s);
  /// Reports a tile to the master that was taken, but not published by itself.
  void tell_taken(wire::TileDone& done);
  void record(const SampledTile& block);
  void answer(const wire::StateRequest& request, const net::Message& message, double now_s);
  void send_answers();
  void on_receipt(const wire::Receipt& receipt, const std::string& peer, double now_s);
  void publish(const Event& event, const wire::Moments& moments = {});
  /// Sets the allowed errors by the session and the links.
  void choose_errors();
  /// Refines patches while heads stand still. Returns true if more can be refined at once.
  bool refine(double now_s);
  wire::StateMark mark(bool answer) const;
  /// Returns the model's digest if one is due; else 0.
  uint64_t due_digest(double now_s);

  Options options_;
  Outlets outlets_;
  metrics::SpanRecorder& spans_;
  InstanceId instance_ = net::make_instance_id(), master_;
  std::vector<uint32_t> lease_key_;  // the master's
  std::optional<PackerCore> core_;   // nullopt until the data set's box is known
  std::optional<Planner> planner_;   // plans for the core's model; nullopt with keep_redundant
  PlanConfig plan_config_;           // the planner's
  points::ModelConfig model_;
  std::array<double, 3> errors_{-1, -1, -1};  // depth, normals, colours, as the session sets them; -1: auto
  bool slow_ = false;                         // some link is slow
  StillHeads heads_;
  double next_refine_s_ = 0, points_came_s_ = -1e9;
  bool refining_ = false;  // more can be refined at once
  BlockGatherer gatherer_;
  EpochHold<Received> ahead_;
  LinkMeter meter_;  // measures the viewers' links
  StateAnswers answers_;
  StateSenders senders_;
  net::PeerRates beginnings_{kBeginnings_s};  // rate of answers that a connection begins
  log::RateLimiter told_of_viewers_;
  Completions completions_;
  uint64_t bytes_sent_ = 0, duplicates_ = 0, other_epoch_ = 0, refused_ = 0, unsealed_ = 0;
  uint64_t records_failed_ = 0;  // depth images that could not be recorded
  uint64_t plans_ = 0;
  FrameId planning_;           // frame whose extra rays are being planned
  double planning_s_ = 0;      // time spent on it so far
  bool told_of_size_ = false;  // logged that views are too large for plans
  double next_settle_s_ = 0;
  double last_mark_s_ = -1e9, last_forget_s_ = -1e9;
  double next_digest_s_ = 0;
  uint64_t digests_told_ = 0;
};

}  // namespace telesplat::packer
