// The packer's part where views come as pictures: each tile goes at once to the viewer that asked for it.
#pragma once

#include <deque>
#include <map>
#include <set>

#include "common/metrics/recorder.h"
#include "services/packer/packing.h"

namespace telesplat::packer {

class PicturePacking final : public Packing {
 public:
  static constexpr size_t kMostFrames = 64;    ///< frames whose tiles are remembered, so that no tile goes out twice
  static constexpr size_t kMostViewers = 256;  ///< with one more, the packer forgets another viewer

  /// Keeps a reference to the spans.
  PicturePacking(Outlets outlets, metrics::SpanRecorder& spans) : outlets_(std::move(outlets)), spans_(spans) {}

  bool follow(const wire::Welcome& session, double now_s) override;
  /// Tiles of an epoch that is not announced yet wait for it; those of earlier epochs are dropped.
  void take_sampled(net::Socket& from, const net::Message& message, double now_s) override;
  /// A viewer introduces itself with a slice_ack.
  void take_state(net::Socket& from, const net::Message& message, double now_s) override;
  void tick(double now_s) override;
  void add_status(net::MasterLink::Values& values) const override;

  /// Takes a decoded tile, with the rules of take_sampled(). Error: the tile is invalid.
  Status receive(const net::Message& message, const wire::PictureTile& tile, double now_s);
  /// Notes the viewer's address, as take_state() does.
  void meet(const std::string& peer, InstanceId viewer);

 private:
  struct Ahead {
    net::Message message;
    wire::PictureTile tile;  // its image lies in the message
  };
  // A tile for a viewer that has not introduced itself yet.
  struct Unmet {
    InstanceId viewer;
    std::string body;
  };
  struct Frame {
    FrameId id;
    std::set<uint64_t> tiles;
  };
  bool is_ahead(const wire::Lease& lease) const { return lease.master != master_ || lease.epoch > epoch_; }
  bool is_first(const wire::Lease& lease);
  void send(InstanceId viewer, std::string body, double now_s);

  Outlets outlets_;
  metrics::SpanRecorder& spans_;
  InstanceId instance_ = net::make_instance_id(), master_;
  EpochId epoch_;
  std::vector<uint32_t> lease_key_;  // the master's
  EpochHold<Ahead> ahead_{{.items = 64, .bytes = 64u << 20}};
  EpochHold<Unmet> unmet_{{.items = 64, .bytes = 64u << 20}};
  std::map<InstanceId, std::string> peers_;  // viewers' addresses
  StateSenders senders_;
  std::deque<Frame> frames_;  // the newest last
  uint64_t tiles_ = 0, duplicate_ = 0, other_epoch_ = 0, unsealed_ = 0, bytes_sent_ = 0;
};

}  // namespace telesplat::packer
