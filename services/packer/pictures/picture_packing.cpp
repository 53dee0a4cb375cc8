#include "services/packer/pictures/picture_packing.h"

#include <algorithm>

#include "common/core/log.h"
#include "common/net/dispatch.h"
#include "common/wire/lease_seal.h"

namespace telesplat::packer {

bool PicturePacking::follow(const wire::Welcome& session, double now_s) {
  if (scene::SessionView(session).pipeline() != scene::Pipeline::kPictures) return false;
  if (master_ != session.master) frames_.clear();  // another master counts frames anew
  master_ = session.master;
  epoch_ = session.epoch;
  lease_key_ = session.lease_key;
  for (const auto& [early, bytes, since_s, user] : ahead_.take()) {
    if (is_ahead(early.tile.lease))
      ahead_.add(early, bytes, since_s, user);
    else if (const Status s = receive(early.message, early.tile, now_s); !s)
      log::warn("a tile that came early was refused: {}", s.error().text);
  }
  return true;
}

void PicturePacking::take_sampled(net::Socket& from, const net::Message& message, double now_s) {
  net::dispatch<wire::PictureTile>(from, message, [&](const wire::PictureTile& m) {
    if (const Status s = receive(message, m, now_s); !s) from.reject(message, s.error().text);
  });
}

void PicturePacking::take_state(net::Socket& from, const net::Message& message, double /*now_s*/) {
  net::dispatch<wire::SliceAck>(from, message, [&](const wire::SliceAck& m) {
    if (!senders_.may_speak(message, m.viewer)) return from.reject(message, kNotItsViewer);
    meet(message.peer, m.viewer);
  });
}

bool PicturePacking::is_first(const wire::Lease& lease) {
  const auto known = std::ranges::find(frames_, lease.frame, &Frame::id);
  if (known != frames_.end()) return known->tiles.insert(lease.tile).second;
  frames_.push_back({lease.frame, {lease.tile}});
  if (frames_.size() > kMostFrames) frames_.pop_front();
  return true;
}

Status PicturePacking::receive(const net::Message& message, const wire::PictureTile& m, double now_s) {
  const wire::Lease& lease = m.lease;
  if (is_ahead(lease)) {
    ahead_.add({message, m}, message.body.size(), now_s, message.user);
    return ok_status();
  }
  if (lease.epoch != epoch_) {
    ++other_epoch_;
    return ok_status();
  }
  if (!wire::is_sealed(lease, m.sampler, lease_key_)) {
    ++unsealed_;
    return Error{"its lease was not given to who says to have drawn it"};
  }
  const uint64_t pixels = uint64_t(lease.rect.width) * uint64_t(lease.rect.height);
  wire::TileDone done{.frame = lease.frame,
                      .tile = lease.tile,
                      .lease = lease.lease,
                      .sampler = m.sampler,
                      .request = lease.request,
                      .rays = lease.rays,
                      .rect = lease.rect,
                      .samples = pixels,
                      .kept = pixels,
                      .bytes_sampled = m.image.size(),
                      .moments = lease.moments};
  wire::Moments& moments = done.moments;
  moments.arrived_s = outlets_.to_master_s(message.arrived_s);
  moments.receive_s = outlets_.to_master_s(now_s);
  if (is_first(lease)) {
    ++tiles_;
    moments.packed_s = moments.published_s = outlets_.master_now();
    bytes_sent_ += done.bytes_sent = m.image.size();
    send(lease.viewer,
         wire::encode(wire::Picture{.packer = instance_,
                                    .epoch = lease.epoch,
                                    .frame = lease.frame,
                                    .viewer = lease.viewer,
                                    .request = lease.request,
                                    .tile = lease.tile,
                                    .tiles_in_frame = lease.blocks_in_frame,
                                    .camera = lease.camera,
                                    .rect = lease.rect,
                                    .moments = moments,
                                    .image = m.image}),
         now_s);
    spans_.add("pack", moments.receive_s, outlets_.master_now(), 0, {.frame = double(lease.frame.value)});
  } else {
    ++duplicate_;
    moments.packed_s = outlets_.master_now();
  }
  outlets_.tell(done);
  return ok_status();
}

void PicturePacking::send(InstanceId viewer, std::string body, double now_s) {
  const auto peer = peers_.find(viewer);
  if (peer == peers_.end()) {
    const size_t bytes = body.size();
    return unmet_.add({viewer, std::move(body)}, bytes, now_s);
  }
  if (!outlets_.to_viewer(peer->second, wire::Picture::kName, std::move(body))) peers_.erase(peer);
}

void PicturePacking::meet(const std::string& peer, InstanceId viewer) {
  if (peers_.size() >= kMostViewers && !peers_.contains(viewer)) peers_.erase(peers_.begin());
  peers_[viewer] = peer;
  for (auto& [unmet, bytes, since_s, user] : unmet_.take()) send(unmet.viewer, std::move(unmet.body), since_s);
}

void PicturePacking::tick(double now_s) {
  ahead_.expire(now_s);
  unmet_.expire(now_s);
}

void PicturePacking::add_status(net::MasterLink::Values& values) const {
  values["bytes_sent"] += double(bytes_sent_);
  values["picture_tiles"] = double(tiles_);
  values["tiles_duplicate"] = double(duplicate_);
  values["tiles_other_epoch"] = double(other_epoch_ + ahead_.dropped());
  values["tiles_unsealed"] = double(unsealed_);
  values["pictures_unmet"] = double(unmet_.dropped());
}

}  // namespace telesplat::packer
