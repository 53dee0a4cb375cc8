// The packer's part for slices (T4.5.2): slabs come in, complete frames go to their viewers.
#pragma once

#include <optional>

#include "common/metrics/recorder.h"
#include "services/packer/packing.h"
#include "services/packer/slices/gatherer.h"

namespace telesplat::packer {

class SlicePacking final : public Packing {
 public:
  /// Keeps a reference to the spans.
  SlicePacking(Outlets outlets, metrics::SpanRecorder& spans) : outlets_(std::move(outlets)), spans_(spans) {}

  bool follow(const wire::Welcome& session, double now_s) override;
  void take_sampled(net::Socket& from, const net::Message& message, double now_s) override;
  void take_state(net::Socket& from, const net::Message& message, double now_s) override;
  void tick(double now_s) override;
  std::optional<double> due_s() const override { return gatherer_.due_s(); }
  void add_status(net::MasterLink::Values& values) const override;

  /// As take_sampled(): slabs of an epoch that is not announced yet wait for it. Error: the slab is not valid.
  Status receive(const net::Message& message, const wire::SliceImages& images, double now_s);
  /// Takes a viewer's acknowledgement, as take_state() does.
  Status acknowledged(const std::string& peer, const wire::SliceAck& ack, double now_s);

 private:
  struct Received {
    net::Message message;
    wire::SliceImages images;  // its data lie in `message`
  };
  bool is_ahead(const wire::SliceImages& images) const {
    return !gatherer_.ready() || images.lease.master != master_ || images.lease.epoch > gatherer_.epoch();
  }
  /// first_s: receives the time when the first frame was sent, on the master's clock; unchanged if none was sent.
  void send_out(double now_s, double* first_s = nullptr);

  Outlets outlets_;
  metrics::SpanRecorder& spans_;
  SliceGatherer gatherer_;
  StateSenders senders_;
  EpochHold<Received> ahead_{{.items = 64, .bytes = 256u << 20}};
  InstanceId instance_ = net::make_instance_id(), master_;
  std::optional<volume::Grid> grid_;
  std::vector<uint32_t> lease_key_;  // the master's
  uint64_t bytes_received_ = 0, bytes_sent_ = 0, bytes_told_ = 0,
           unsealed_ = 0;  // bytes_told_: those of bytes_sent_ that were reported to the master
};

}  // namespace telesplat::packer
