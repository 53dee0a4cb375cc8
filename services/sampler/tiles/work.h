// The adapter between leases of tiles and what samples them: it holds the leases and makes depth tiles of the samples,
// or pictures where the session shows these.
#pragma once

#include <deque>
#include <memory>

#include "services/sampler/tiles/picture_maker.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class TileWork final : public Work {
 public:
  /// Keeps a reference to the link: who we are, and the master's clock.
  TileWork(std::unique_ptr<TileSource> source, net::MasterLink& link) : source_(std::move(source)), link_(link) {}

  const char* name() const override { return source_->name(); }
  void on_welcome(const wire::Welcome& session) override {
    source_->on_welcome(session);
    pictures_.follow(session);
  }
  bool takes_leases() const override { return source_->takes_leases(); }
  /// All pixels of a lease whose mask is none are sampled, with a line: dropped, it would come again when it has run
  /// out, as would the view that waits for it.
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
