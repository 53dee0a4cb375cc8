// The adapter between leases of tiles and the source that samples them: it holds the leases and encodes the samples as
// depth tiles, or as pictures if the session shows pictures.
#pragma once

#include <deque>
#include <memory>

#include "services/sampler/tiles/picture_maker.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class TileWork final : public Work {
 public:
  /// Keeps a reference to the link, for this sampler's instance and the master's clock.
  TileWork(std::unique_ptr<TileSource> source, net::MasterLink& link) : source_(std::move(source)), link_(link) {}

  const char* name() const override { return source_->name(); }
  void on_welcome(const wire::Welcome& session) override {
    source_->on_welcome(session);
    pictures_.follow(session);
  }
  bool takes_leases() const override { return source_->takes_leases(); }
  /// If a lease's mask cannot be decoded, all its pixels are sampled, and the log says so: dropped, it would come again
  /// when it has run out, and its view would wait for it.
  void take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) override;
  size_t leases() const override { return leases_.size(); }
  void drop_leases() override { leases_.clear(); }
  Readiness look_at_next(double now_s) override;
  Delivery sample_next() override;
  void fetch(double now_s) override { source_->fetch(leases_.empty() ? nullptr : &leases_.front(), now_s); }
  std::vector<net::Socket*> sockets() override { return source_->sockets(); }
  void receive(double) override { source_->receive(); }
  void add_status(net::MasterLink::Values& values) const override { source_->add_status(values); }

 private:
  void hold(const wire::Lease& lease, double arrived_s, double now_s);
  Delivery picture(const HeldLease& held);
  static Delivery deliver(std::string_view type, const HeldLease& held, const Sampled& sampled);
  wire::Lease finished(const HeldLease& held, const Delivery& delivery) const;

  std::unique_ptr<TileSource> source_;
  net::MasterLink& link_;
  std::deque<HeldLease> leases_;
  PictureMaker pictures_;
};

}  // namespace telesplat::sampler
