#include "services/sampler/tiles/work.h"

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/codec/room_axes.h"
#include "common/core/log.h"
#include "common/geometry/camera.h"
#include "common/net/dispatch.h"

namespace telesplat::sampler {

void TileWork::take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) {
  net::dispatch<wire::Lease>(from, message, [&](const wire::Lease& lease) {
    if (takes_leases && leases_.size() < kMaxHeld) hold(lease, message.arrived_s, now_s);
  });
}

// Adds a lease. Decodes its mask once and takes it out: it does not go on to the packer.
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
  if (pictures_.on()) return picture(held);
  const Sampled sampled = source_->sample(held);
  const auto stream = codec::encode(sampled.image, {}, nullptr, geometry::ray_axes(held.lease.camera, held.lease.rect));
  Delivery out = deliver(wire::DepthTile::kName, held, sampled);
  out.body = wire::encode(
      wire::DepthTile{link_.instance(), finished(held, out), std::as_bytes(std::span(stream)), sampled.coarse});
  return out;
}

// Samples a tile and makes a picture of it. If the source cannot sample it finer, it has one ray a pixel.
Delivery TileWork::picture(const HeldLease& held) {
  PictureMaker::Rays rays = pictures_.rays(held.lease);
  HeldLease fine{rays.lease.value_or(held.lease), held.received_s};
  if (rays.lease && source_->readiness(fine, monotonic_s()).state != Readiness::State::kReady)
    rays.side = 1, fine.lease = held.lease;
  const Sampled sampled = source_->sample(fine);
  const auto jpeg = pictures_.picture(held.lease, rays, sampled.image);
  Delivery out = deliver(wire::PictureTile::kName, held, sampled);
  out.body = wire::encode(wire::PictureTile{link_.instance(), finished(held, out), jpeg});
  return out;
}

// Returns a delivery whose encoding ends now, without its body.
Delivery TileWork::deliver(std::string_view type, const HeldLease& held, const Sampled& sampled) {
  const wire::Lease& lease = held.lease;
  return {type,
          {},
          sampled.begin_s,
          sampled.end_s,
          monotonic_s(),
          {double(lease.frame.value), double(lease.tile), double(lease.request.value)}};
}

wire::Lease TileWork::finished(const HeldLease& held, const Delivery& d) const {
  wire::Lease out = held.lease;
  if (held.waits_since_s > 0) out.moments.fetch_s = d.begin_s - held.waits_since_s;
  out.moments.sample_begin_s = link_.to_master_s(d.begin_s);
  out.moments.sample_end_s = link_.to_master_s(d.sampled_s);
  out.moments.encode_end_s = link_.to_master_s(d.encoded_s);
  return out;
}

}  // namespace telesplat::sampler
