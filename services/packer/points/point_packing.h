// The packer's part for points (T4.3): depth tiles come in, point-model events go out, late joiners get the events that
// they lack.
#pragma once

#include <optional>
#include <vector>

#include "common/metrics/process.h"
#include "common/metrics/recorder.h"
#include "services/packer/packing.h"
#include "services/packer/points/base/base_feed.h"
#include "services/packer/points/block_gatherer.h"
#include "services/packer/points/depth_recorder.h"
#include "services/packer/points/exactness.h"
#include "services/packer/points/model_feed.h"
#include "services/packer/points/planning.h"

namespace telesplat::packer {

class PointPacking final : public Packing {
 public:
  static constexpr double kForgetPeriod_s = 1.0;  ///< between two searches for obsolete clusters

  struct Options {
    int threads = 1;                    ///< for reference depth maps; 0: all cores
    uint64_t max_log_bytes = 0;         ///< Config::max_log_bytes
    StateAnswers::Limits answers = {};  ///< for viewers that join or have gaps
    DepthRecorder* recorder = nullptr;  ///< records sampled depth images; null: not recorded
    net::Context* context = nullptr;    ///< for the base's socket; null: viewers get no base
  };
  /// Keeps a reference to the spans, and the recorders' addresses.
  PointPacking(const Options& options, Outlets outlets, metrics::SpanRecorder& spans)
      : options_(options),
        outlets_(std::move(outlets)),
        spans_(spans),
        feed_(outlets_, options.answers),
        base_(options.context, outlets_),
        planning_(outlets_, spans) {}
  PointPacking(const PointPacking&) = delete;  // its parts refer to it

  bool follow(const wire::Welcome& session, double now_s) override;
  void take_sampled(net::Socket& from, const net::Message& message, double now_s) override;
  void take_state(net::Socket& from, const net::Message& message, double now_s) override;
  std::vector<net::Socket*> sockets() override { return base_.sockets(); }
  void receive() override { base_.receive(); }
  void end_frame(const wire::FrameEnd& end, double now_s) override;
  wire::Plan plan(const wire::PlanRequest& request, double now_s) override;
  std::optional<wire::Plan> plan_piece(const wire::PlanRequest& request, double now_s) override;
  bool hurried(double now_s) const override {
    return planning_.planner() && planning_.planner()->view_under_way(now_s);
  }
  bool idle(double now_s) override { return planning_.settle(now_s); }
  void tick(double now_s) override;
  std::optional<double> due_s() const override {
    return feed_.answers().can_go_on() || exactness_.under_way() ? std::optional(0.0) : std::nullopt;
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
  void pack(const Received& received, double since_s, double now_s);
  void refuse(const Received& received, const std::string& why);
  /// Packs a complete block. stream: of the whole block, if it came as one tile; else null.
  ///     whole: every pixel of the block was cast.
  Status pack_block(SampledTile block, bool whole, std::shared_ptr<const std::vector<uint8_t>> stream,
                    wire::TileDone& done, double now_s);
  /// Reports a tile to the master that was taken, but not published by itself.
  void tell_taken(wire::TileDone& done);
  void record(const SampledTile& block);
  void publish_forgets(const std::vector<Event>& events);
  void choose_errors();
  void refine(double now_s);

  Options options_;
  Outlets outlets_;
  metrics::SpanRecorder& spans_;
  InstanceId master_;
  std::vector<uint32_t> lease_key_;  // the master's
  std::optional<PackerCore> core_;   // nullopt until the data set's box is known
  ModelFeed feed_;
  BaseFeed base_;
  Planning planning_;
  Exactness exactness_;
  BlockGatherer gatherer_;
  EpochHold<Received> ahead_;
  StateSenders senders_;
  uint64_t bytes_sent_ = 0, duplicates_ = 0, other_epoch_ = 0, refused_ = 0, unsealed_ = 0;
  uint64_t records_failed_ = 0;  // depth images that could not be recorded
  double last_forget_s_ = -1e9;
};

}  // namespace telesplat::packer
