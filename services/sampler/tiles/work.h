// Leases of tiles of depth images: meshes, Julia sets, replays.
#pragma once

#include <deque>
#include <memory>

#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class TileWork final : public SamplingWork {
 public:
  /// Keeps a reference to the link: who we are, and the master's clock.
  TileWork(std::unique_ptr<LeaseWork> work, net::MasterLink& link) : work_(std::move(work)), link_(link) {}

  const char* name() const override { return work_->name(); }
  void on_welcome(const wire::Welcome& session) override { work_->on_welcome(session); }
  bool takes_leases() const override { return work_->takes_leases(); }
  void take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) override;
  size_t leases() const override { return leases_.size(); }
  void drop_leases() override { leases_.clear(); }
  Readiness look_at_next(double now_s) override;
  Delivery sample_next() override;
  void fetch(double now_s) override { work_->fetch(leases_.empty() ? nullptr : &leases_.front(), now_s); }
  std::vector<net::Socket*> sockets() override { return work_->sockets(); }
  void receive(double) override { work_->receive(); }
  void add_status(net::MasterLink::Values& values) const override { work_->add_status(values); }

 private:
  std::unique_ptr<LeaseWork> work_;
  net::MasterLink& link_;
  std::deque<HeldLease> leases_;
};

}  // namespace telesplat::sampler
