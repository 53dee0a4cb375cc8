#include "services/sampler/tiles/work.h"

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/codec/room_axes.h"
#include "common/core/log.h"
#include "common/geometry/ray_axes.h"
#include "common/net/dispatch.h"

namespace telesplat::sampler {

void TileWork::take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) {
  net::dispatch<wire::Lease>(from, message, [&](const wire::Lease& lease) {
    if (takes_leases && leases_.size() < kMaxHeld) hold(lease, message.arrived_s, now_s);
  });
}

// The mask is decoded once, and does not go on to the packer.
void TileWork::hold(const wire::Lease& lease, double arrived_s, double now_s) {
  HeldLease held{.lease = lease, .received_s = now_s};
  held.lease.moments.lease_arrived_s = link_.to_master_s(arrived_s);
  if (!lease.mask.empty()) {
    held.lease.mask.clear();
    auto mask = codec::decode_mask(lease.mask, lease.rect.width, lease.rect.height);
    if (mask) {
      held.mask = std::move(*mask);
    } else {
      held.lease.rays = uint64_t(lease.rect.width) * uint64_t(lease.rect.height);
      log::warn("lease {}: {}; all pixels are sampled", lease.lease.value, mask.error().text);
    }
  }
  leases_.push_back(std::move(held));
}

Readiness TileWork::look_at_next(double now_s) {
  while (!leases_.empty()) {
    HeldLease& next = leases_.front();
    const Readiness r = source_->readiness(next, now_s);
    if (r.state == Readiness::State::kWaits && next.waits_since_s == 0) next.waits_since_s = now_s;
    if (r.state != Readiness::State::kHopeless) return r;
    leases_.pop_front();
  }
  return {Readiness::State::kWaits};
}

Delivery TileWork::sample_next() {
  const HeldLease held = std::move(leases_.front());
  leases_.pop_front();
  const Sampled sampled = source_->sample(held);
  const auto stream = codec::encode(sampled.image, {}, nullptr, geometry::ray_axes(held.lease.camera, held.lease.rect));
  Delivery out{wire::DepthTile::kName,
               {},
               sampled.begin_s,
               sampled.end_s,
               monotonic_s(),
               {double(held.lease.frame.value), double(held.lease.tile), double(held.lease.request.value)}};
  wire::DepthTile tile{link_.instance(), held.lease};
  wire::Moments& moments = tile.lease.moments;
  if (held.waits_since_s > 0) moments.fetch_s = out.begin_s - held.waits_since_s;
  moments.sample_begin_s = link_.to_master_s(out.begin_s);
  moments.sample_end_s = link_.to_master_s(out.sampled_s);
  moments.encode_end_s = link_.to_master_s(out.encoded_s);
  tile.image = std::as_bytes(std::span(stream));
  out.body = wire::encode(tile);
  return out;
}

}  // namespace telesplat::sampler
