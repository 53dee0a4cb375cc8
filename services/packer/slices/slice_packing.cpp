#include "services/packer/slices/slice_packing.h"

#include "common/core/log.h"
#include "common/net/dispatch.h"
#include "common/volume/session.h"
#include "common/wire/lease_seal.h"

namespace telesplat::packer {

bool SlicePacking::follow(const wire::Welcome& session, double now_s) {
  if (scene::SessionView(session).pipeline() != scene::Pipeline::kSlices) return false;
  const auto read = volume::read_session(session.parameters, session.facts);
  const Status valid = read ? volume::validate(read->grid) : Status(read.error());
  if (!valid) {
    log::error("the master's volume cannot be packed: {}", valid.error().text);
    return true;
  }
  // Frames are told apart by their numbers, and another master counts from 1 again: a new packer id shows viewers that
  // its frames are others.
  if (master_ != session.master || grid_ != read->grid) {
    gatherer_.clear_frames();
    instance_ = net::make_instance_id();
    master_ = session.master;
    grid_ = read->grid;
  }
  lease_key_ = session.lease_key;
  gatherer_.set_scene(read->grid, session.epoch);
  gatherer_.set_most(session.settings.max_rate_mbit * 1e6 / 8);
  for (const auto& [received, bytes, since_s, user] : ahead_.take()) {
    if (is_ahead(received.images))
      ahead_.add(received, bytes, since_s, user);
    else if (const Status s = receive(received.message, received.images, now_s); !s)
      log::warn("a slab that came early was refused: {}", s.error().text);
  }
  return true;
}

void SlicePacking::take_sampled(net::Socket& from, const net::Message& message, double now_s) {
  net::dispatch<wire::SliceImages>(from, message, [&](const wire::SliceImages& m) {
    if (const Status s = receive(message, m, now_s); !s) from.reject(message, s.error().text);
  });
}

void SlicePacking::take_state(net::Socket& from, const net::Message& message, double now_s) {
  net::dispatch<wire::SliceAck>(from, message, [&](const wire::SliceAck& m) {
    if (!senders_.may_speak(message, m.viewer)) return from.reject(message, kNotItsViewer);
    if (const Status s = acknowledged(message.peer, m, now_s); !s) from.reject(message, s.error().text);
  });
}

Status SlicePacking::receive(const net::Message& message, const wire::SliceImages& m, double now_s) {
  if (is_ahead(m)) {
    ahead_.add({message, m}, message.body.size(), now_s, message.user);
    return ok_status();
  }
  if (m.lease.epoch != gatherer_.epoch()) {
    (void)gatherer_.add({m, message.owner}, now_s);  // add() counts it
    return ok_status();
  }
  if (!wire::is_sealed(m.lease, m.sampler, lease_key_)) {
    ++unsealed_;
    return Error{"its lease was not given to who says to have sampled it"};
  }
  const double receive_s = outlets_.to_master_s(now_s);
  SliceGatherer::Slab slab{m, message.owner};
  wire::Moments& moments = slab.images.lease.moments;
  moments.arrived_s = outlets_.to_master_s(message.arrived_s);
  moments.receive_s = receive_s;
  const auto added = gatherer_.add(slab, now_s);
  if (!added) {
    if (outlets_.refuse) outlets_.refuse({m.lease.frame, m.lease.slab, m.lease.lease, m.sampler, added.error().text});
    return added.error();
  }
  bytes_received_ += m.data.size();
  wire::TileDone done{.frame = m.lease.frame,
                      .tile = m.lease.slab,
                      .lease = m.lease.lease,
                      .sampler = m.sampler,
                      .request = m.lease.views.size() == 1 ? m.lease.views[0].request : RequestId{},
                      .rect = {0, 0, m.lease.shear.width, m.lease.shear.height},
                      .samples = m.voxels,
                      .kept = added->blocks * volume::kSliceBlock * volume::kSliceBlock,
                      .bytes_sampled = m.data.size(),
                      .moments = moments};
  // The figures of a frame go to the slab that completed it. A slab that came before is done: the master may not know.
  if (added->frame_complete) {
    gatherer_.packed(outlets_.master_now());
    send_out(now_s, &done.moments.published_s);
    // Frames that go out later, when their viewer is ready, count for the next frame.
    done.bytes_sent = bytes_sent_ - bytes_told_;
    bytes_told_ = bytes_sent_;
    spans_.add("pack", receive_s, outlets_.master_now(), 0, {.frame = double(done.frame.value)});
  }
  done.moments.packed_s = done.moments.published_s > 0 ? done.moments.published_s : outlets_.master_now();
  outlets_.tell(done);
  return ok_status();
}

void SlicePacking::send_out(double now_s, double* first_s) {
  while (auto out = gatherer_.take_outgoing(now_s)) {
    out->frame.packer = instance_;
    // The moment is taken before sending: a viewer may have the frame before the send returns.
    out->frame.moments.published_s = outlets_.master_now();
    if (first_s && *first_s == 0) *first_s = out->frame.moments.published_s;
    if (!outlets_.send(out->frame, out->peer)) {
      gatherer_.unreachable(out->peer);
      continue;
    }
    bytes_sent_ += out->frame.data.size();
  }
}

Status SlicePacking::acknowledged(const std::string& peer, const wire::SliceAck& ack, double now_s) {
  const Status s = gatherer_.acknowledged(peer, ack, now_s);
  for (const auto& refused : gatherer_.take_refused())
    if (outlets_.refuse) outlets_.refuse(refused);
  send_out(now_s);
  return s;
}

void SlicePacking::tick(double now_s) {
  gatherer_.expire(now_s);
  send_out(now_s);  // frames that were held back while a link was busy
  ahead_.expire(now_s);
}

void SlicePacking::add_status(net::MasterLink::Values& values) const {
  if (!gatherer_.ready()) return;
  const auto& s = gatherer_.statistics();
  values["bytes_sent"] += double(bytes_sent_);
  values["slice_bytes_received"] = double(bytes_received_);
  values["slabs"] = double(s.slabs);
  values["slabs_duplicate"] = double(s.slabs_duplicate);
  values["slabs_other_epoch"] = double(s.slabs_other_epoch + ahead_.dropped());
  values["slabs_refused"] = double(s.slabs_refused);
  values["slabs_unsealed"] = double(unsealed_);
  values["volume_frames_complete"] = double(s.frames_complete);
  values["volume_frames_dropped"] = double(s.frames_dropped);
  values["volume_frames_sent"] = double(s.frames_sent);
  values["volume_frames_skipped"] = double(s.frames_skipped);
  values["volume_viewers"] = double(gatherer_.viewers());
  values["volume_viewers_forgotten"] = double(s.viewers_forgotten);
}

}  // namespace telesplat::packer
