// The packer's part for volumes: slabs come in, complete frames go to their viewers, the master is told. Who sends is not its business.
#pragma once

#include <functional>

#include "common/metrics/recorder.h"
#include "common/net/master_link.h"
#include "services/packer/epoch_hold.h"
#include "services/packer/slices/gatherer.h"

namespace telesplat::packer {

class VolumePacking {
 public:
  struct Links {
    std::function<void(const wire::TileDone&)> tell;                             ///< the master
    std::function<bool(const wire::SliceFrame&, const std::string& peer)> send;  ///< a viewer; false: it is gone
    std::function<double()> master_now;
    std::function<double(double)> to_master_s;
  };
  /// Keeps a reference to the spans.
  VolumePacking(Links links, metrics::SpanRecorder& spans) : links_(std::move(links)), spans_(spans) {}

  /// Whether the session is of a volume: then it is followed.
  bool follow(const wire::Welcome& session, double now_s);

  /// Slabs of an epoch that is not announced yet wait for it. Error: what makes no sense.
  Status receive(const net::Message& message, const wire::SliceImages& images, double now_s);
  Status acknowledged(const std::string& peer, const wire::SliceAck& ack, double now_s);
  void tick(double now_s);

  void add_status(net::MasterLink::Values& values) const;

 private:
  struct Received {
    net::Message message;
    wire::SliceImages images;  // its data lie in the message
  };
  bool is_ahead(const wire::SliceImages& images) const {
    return !gatherer_.ready() || images.lease.epoch > gatherer_.epoch();
  }
  uint64_t send_out(double now_s);

  Links links_;
  metrics::SpanRecorder& spans_;
  SliceGatherer gatherer_;
  EpochHold<Received> ahead_{{.items = 64, .bytes = 256u << 20}};
  InstanceId instance_ = net::make_instance_id(), master_;
  std::optional<volume::Grid> grid_;
  uint64_t bytes_received_ = 0, bytes_sent_ = 0;
};

}  // namespace telesplat::packer
