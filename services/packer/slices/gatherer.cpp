#include "services/packer/slices/gatherer.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/volume/slices/view.h"

namespace telesplat::packer {

namespace {

constexpr size_t kMaxWaiting = 2 * wire::kMaxBuffers;  // for a viewer that wants all its frames: the master's limit

bool same_frame(const wire::SliceLease& a, const wire::SliceLease& b) {
  const auto same_view = [](const wire::SliceView& x, const wire::SliceView& y) {
    return x.viewer == y.viewer && x.request == y.request && x.camera == y.camera && x.buffers == y.buffers;
  };
  return a.epoch == b.epoch && a.partition == b.partition && a.slabs == b.slabs && a.shear == b.shear &&
         std::equal(a.views.begin(), a.views.end(), b.views.begin(), b.views.end(), same_view);
}

}  // namespace

void SliceGatherer::set_scene(const volume::Grid& grid, EpochId epoch) {
  if (grid_ && *grid_ != grid) clear_frames();
  if (epoch != epoch_ || !grid_) {
    statistics_.frames_dropped += open_.size();
    open_.clear();
    newest_ = nullptr;
  }
  grid_ = grid;
  epoch_ = epoch;
}

void SliceGatherer::set_most(double bytes_s) {
  most_bytes_s_ = bytes_s;
  for (auto& [id, v] : viewers_) v.pace.set_most(bytes_s);
}

void SliceGatherer::clear_frames() {
  statistics_.frames_dropped += open_.size();
  open_.clear();
  closed_.clear();
  newest_ = nullptr;
  for (auto& [id, v] : viewers_) {
    v.unacknowledged.clear();
    v.pace.lost();
    v.waiting.clear();
    v.newest = {};
  }
}

Status SliceGatherer::check(const wire::SliceLease& l) const {
  if (l.slabs < 1 || l.slabs > wire::kMaxSlabs || l.slab >= l.slabs)
    return Error{fmt::format("slab {} of {}, limit {}", l.slab, l.slabs, wire::kMaxSlabs)};
  if (l.begin >= l.end || l.end > uint64_t(grid_->size[2]))
    return Error{fmt::format("a slab of slices {} to {} of {}", l.begin, l.end, grid_->size[2])};
  if (l.views.empty() || l.views.size() > wire::kMaxViews)
    return Error{fmt::format("{} views, limits 1 and {}", l.views.size(), wire::kMaxViews)};
  return volume::validate(l.shear, *grid_);
}

void SliceGatherer::drop(Frames::iterator frame) {
  ++statistics_.frames_dropped;
  open_.erase(frame);
}

// Drops the oldest frames until a frame's first slab, of `bytes` bytes, fits in.
void SliceGatherer::make_room(size_t bytes) {
  size_t held = bytes;
  for (const auto& f : open_) held += f->bytes;
  while (!open_.empty() && (open_.size() >= kMaxOpenVolumeFrames || held > kMaxOpenVolumeBytes)) {
    held -= open_.front()->bytes;
    drop(open_.begin());
  }
}

std::shared_ptr<SliceGatherer::Frame> SliceGatherer::frame_of(const wire::SliceLease& lease, size_t bytes) {
  if (const auto open = find_open(lease.frame); open != open_.end()) return *open;
  make_room(bytes);
  const auto frame = std::make_shared<Frame>();
  frame->lease = lease;
  frame->slabs.resize(lease.slabs);
  frame->slices.resize(lease.slabs);
  frame->missing = lease.slabs;
  open_.push_back(frame);
  return frame;
}

SliceGatherer::Frames::iterator SliceGatherer::find_open(FrameId id) {
  return std::find_if(open_.begin(), open_.end(), [&](const auto& f) { return f->lease.frame == id; });
}

bool SliceGatherer::is_here(const wire::SliceLease& lease) {
  if (const auto open = find_open(lease.frame); open != open_.end())
    return same_frame((*open)->lease, lease) && (*open)->slabs[lease.slab].owner != nullptr;
  return std::find(closed_.begin(), closed_.end(), lease.frame) != closed_.end();
}

// Checks that a lease does not contradict the frame's earlier slabs.
Status SliceGatherer::check_beside_others(const wire::SliceLease& lease) {
  const auto open = find_open(lease.frame);
  if (open == open_.end()) return ok_status();
  if (!same_frame((*open)->lease, lease)) return Error{"its slabs were leased with another view, raster or partition"};
  for (const Slab& s : (*open)->slabs)
    if (s.owner && lease.begin < s.images.lease.end && s.images.lease.begin < lease.end)
      return Error{fmt::format("slab {} has slices of slab {}", lease.slab, s.images.lease.slab)};
  return ok_status();
}

Result<SliceGatherer::Added> SliceGatherer::add(Slab slab, double now_s) {
  const wire::SliceLease lease = slab.images.lease;
  const auto refuse = [&](const std::string& why) -> Result<Added> {
    ++statistics_.slabs_refused;
    return Error{fmt::format("frame {}: {}", lease.frame.value, why)};
  };
  if (lease.epoch != epoch_) {
    ++statistics_.slabs_other_epoch;
    return Added{};
  }
  if (const Status s = check(lease); !s) return refuse(s.error().text);
  if (is_here(lease)) {
    ++statistics_.slabs_duplicate;
    return Added{};
  }
  if (const Status s = check_beside_others(lease); !s) return refuse(s.error().text);
  const std::span bytes(reinterpret_cast<const uint8_t*>(slab.images.data.data()), slab.images.data.size());
  auto slices = volume::parse_slices(bytes, lease.shear.width, lease.shear.height, int(lease.shear.layers.size()));
  if (!slices) return refuse(slices.error().text);
  Added out{.is_new = true};
  for (const auto& s : *slices) {
    if (uint64_t(s.k_begin) != lease.begin || uint64_t(s.k_end) != lease.end)
      return refuse(
          fmt::format("an image of slices {} to {} in the slab {} to {}", s.k_begin, s.k_end, lease.begin, lease.end));
    out.blocks += s.blocks.size();
  }
  const std::shared_ptr<Frame> frame = frame_of(lease, bytes.size());
  ++statistics_.slabs;
  frame->moments = lease.moments;
  frame->voxels += slab.images.voxels;
  frame->bytes += bytes.size();
  frame->slices[lease.slab] = std::move(*slices);
  frame->slabs[lease.slab] = std::move(slab);
  if (--frame->missing > 0) return out;
  out.frame_complete = true;
  open_.erase(find_open(lease.frame));
  completed_ = frame;
  complete(frame, now_s);
  return out;
}

void SliceGatherer::packed(double master_s) {
  if (completed_) completed_->moments.packed_s = master_s;
}

void SliceGatherer::complete(const std::shared_ptr<Frame>& frame, double now_s) {
  ++statistics_.frames_complete;
  closed_.push_back(frame->lease.frame);
  if (closed_.size() > kMaxClosedFrames) closed_.pop_front();
  if (!newest_ || newest_->lease.frame < frame->lease.frame) newest_ = frame;
  for (const auto& view : frame->lease.views) {
    const bool is_new = !viewers_.contains(view.viewer);
    Viewer& v = viewer(view.viewer, now_s);
    if (is_new) v.in_order = view.buffers > 0;
    queue(v, {frame, view});
  }
}

SliceGatherer::Viewer& SliceGatherer::viewer(InstanceId id, double now_s) {
  const auto known = viewers_.find(id);
  if (known != viewers_.end()) return known->second;
  if (viewers_.size() >= kMaxSliceViewers) {
    viewers_.erase(std::min_element(viewers_.begin(), viewers_.end(),
                                    [](const auto& a, const auto& b) { return a.second.heard_s < b.second.heard_s; }));
    ++statistics_.viewers_forgotten;
  }
  Viewer& v = viewers_[id];
  v.heard_s = now_s;
  v.pace.set_most(most_bytes_s_);
  return v;
}

void SliceGatherer::queue(Viewer& v, Waiting waiting) {
  const FrameId id = waiting.frame->lease.frame;
  if (id <= v.newest) {
    ++statistics_.frames_skipped;
    return;
  }
  v.newest = id;
  const size_t most = v.in_order ? kMaxWaiting : 1;
  v.waiting.push_back(std::move(waiting));
  for (; v.waiting.size() > most; v.waiting.pop_front()) ++statistics_.frames_skipped;
}

Status SliceGatherer::acknowledged(const std::string& peer, const wire::SliceAck& ack, double now_s) {
  if (ack.buffers < 1 || ack.buffers > wire::kMaxBuffers)
    return Error{fmt::format("a viewer with {} buffers, limits 1 and {}", ack.buffers, wire::kMaxBuffers)};
  const auto known = viewers_.find(ack.viewer);
  bool begins = known == viewers_.end() || known->second.peer != peer;
  Viewer& v = viewer(ack.viewer, now_s);
  v.peer = peer;
  v.buffers = ack.buffers;
  v.in_order = ack.in_order;
  v.heard_s = now_s;
  if (ack.frame.value != 0) v.sent_again = false;
  const auto sent = std::find_if(v.unacknowledged.begin(), v.unacknowledged.end(),
                                 [&](const Waiting& w) { return w.frame->lease.frame == ack.frame; });
  if (ack.damaged && sent != v.unacknowledged.end()) look_at(*std::shared_ptr(sent->frame), now_s);
  if (!begins && ack.frame.value == 0 && seems_lost(v, now_s)) begins = v.sent_again = true;
  if (begins) {
    // Frames under way on a broken connection are lost.
    v.waiting.insert(v.waiting.begin(), v.unacknowledged.begin(), v.unacknowledged.end());
    v.unacknowledged.clear();
    v.pace.lost();
  } else {
    v.pace.acknowledged(ack.frame, now_s);
    std::erase_if(v.unacknowledged, [&](const Waiting& w) { return w.frame->lease.frame == ack.frame; });
  }
  for (; !v.in_order && v.waiting.size() > 1; v.waiting.pop_front()) ++statistics_.frames_skipped;
  if (!begins || !newest_ || v.in_order || !v.waiting.empty()) return ok_status();
  const auto& views = newest_->lease.views;
  const auto own =
      std::find_if(views.begin(), views.end(), [&](const auto& view) { return view.viewer == ack.viewer; });
  v.newest = newest_->lease.frame;
  v.waiting.push_back({newest_, own != views.end() ? *own : wire::SliceView{ack.viewer, {}, views.front().camera, 0},
                       own == views.end()});
  return ok_status();
}

// Decodes every slab: the viewer's report may be false.
void SliceGatherer::look_at(Frame& frame, double now_s) {
  if (frame.looked_at || !looks_.take(now_s)) return;
  frame.looked_at = true;
  const auto& shear = frame.lease.shear;
  const size_t before = refused_.size();
  volume::SliceImage image;
  for (size_t i = 0; i < frame.slabs.size(); ++i)
    for (const auto& slice : frame.slices[i])
      if (const Status s = volume::decode_slice_into(image, slice, shear.width, shear.height); !s) {
        const auto& [sampler, lease, voxels, data] = frame.slabs[i].images;
        refused_.push_back({lease.frame, lease.slab, lease.lease, sampler, s.error().text});
        break;
      }
  if (refused_.size() == before) return;
  statistics_.slabs_refused += refused_.size() - before;
  if (newest_.get() == &frame) newest_ = nullptr;
  for (auto& [id, v] : viewers_) std::erase_if(v.waiting, [&](const Waiting& w) { return w.frame.get() == &frame; });
}

// A viewer in order may keep frames in its buffers as long as it likes: no frame of it seems lost.
bool SliceGatherer::seems_lost(const Viewer& v, double now_s) {
  if (v.in_order || v.sent_again || v.unacknowledged.empty()) return false;
  const double rate = v.pace.rate_bytes_s();
  double bytes = 0;
  for (const Waiting& w : v.unacknowledged) bytes += double(w.bytes);
  return now_s - v.unacknowledged.front().sent_s >
         std::max(kViewerPatience_s, rate > 0 ? kLostAfter * bytes / rate : 0);
}

void SliceGatherer::unreachable(const std::string& peer) {
  statistics_.viewers_forgotten += std::erase_if(viewers_, [&](const auto& v) { return v.second.peer == peer; });
}

void SliceGatherer::expire(double now_s) {
  statistics_.viewers_forgotten += std::erase_if(viewers_, [&](const auto& entry) {
    const Viewer& v = entry.second;
    const bool owes = v.peer.empty() || !v.unacknowledged.empty();
    return owes && now_s - v.heard_s > kViewerPatience_s;
  });
}

bool SliceGatherer::has_room(const Viewer& v) {
  return !v.peer.empty() && !v.waiting.empty() && v.unacknowledged.size() < v.buffers;
}

double SliceGatherer::may_send_s(const Viewer& v) { return v.in_order ? v.pace.wished_s() : v.pace.next_s(); }

std::optional<double> SliceGatherer::due_s() const {
  std::optional<double> out;
  for (const auto& [id, v] : viewers_)
    if (has_room(v)) out = std::min(out.value_or(1e300), may_send_s(v));
  return out;
}

std::optional<SliceGatherer::Outgoing> SliceGatherer::take_outgoing(double now_s) {
  // The viewer after the one served last comes first.
  auto next = viewers_.upper_bound(turn_);
  for (size_t n = 0; n < viewers_.size(); ++n, ++next) {
    if (next == viewers_.end()) next = viewers_.begin();
    Viewer& v = next->second;
    if (!has_room(v) || now_s < may_send_s(v)) continue;
    turn_ = next->first;
    if (v.unacknowledged.empty()) v.heard_s = std::max(v.heard_s, now_s);
    v.unacknowledged.push_back(std::move(v.waiting.front()));
    v.waiting.pop_front();
    ++statistics_.frames_sent;
    Outgoing out = make(next->first, v, v.unacknowledged.back());
    v.unacknowledged.back().sent_s = now_s;
    v.unacknowledged.back().bytes = out.bytes->size();
    v.pace.sent(out.frame.frame, out.bytes->size(), now_s);
    return out;
  }
  return std::nullopt;
}

SliceGatherer::Outgoing SliceGatherer::make(InstanceId id, const Viewer& v, const Waiting& waiting) const {
  const Frame& frame = *waiting.frame;
  const volume::SliceView view(*grid_, frame.lease.shear, waiting.view.camera, kViewMargin);
  std::vector<volume::EncodedSlice> seen;
  for (const auto& slab : frame.slices)
    for (const auto& slice : slab) {
      volume::EncodedSlice& part = seen.emplace_back();
      part.layer = slice.layer, part.k_begin = slice.k_begin, part.k_end = slice.k_end, part.tables = slice.tables;
      std::copy_if(slice.blocks.begin(), slice.blocks.end(), std::back_inserter(part.blocks),
                   [&](const auto& b) { return waiting.whole || view.may_see(slice.layer, b.x, b.y); });
    }
  Outgoing out{v.peer, {}, std::make_shared<const std::vector<uint8_t>>(volume::join_slices(seen))};
  out.frame.epoch = frame.lease.epoch;
  out.frame.frame = frame.lease.frame;
  out.frame.viewer = id;
  out.frame.request = waiting.view.request;
  out.frame.camera = waiting.view.camera;
  out.frame.shear = frame.lease.shear;
  out.frame.slabs = frame.lease.slabs;
  out.frame.voxels = frame.voxels;
  out.frame.moments = frame.moments;
  const wire::Moments& view_moments = waiting.view.moments;
  out.frame.moments.requested_s = view_moments.requested_s;
  out.frame.moments.received_s = view_moments.received_s;
  out.frame.moments.begun_s = view_moments.begun_s;
  out.frame.data = std::as_bytes(std::span(*out.bytes));
  return out;
}

void SlicePace::sent(FrameId frame, uint64_t bytes, double now_s) {
  under_way_.push_back({frame, bytes, now_s, frame <= newest_});
  newest_ = std::max(newest_, frame);
  if (wished_ > 0) wish_s_ = std::max(wish_s_, now_s) + static_cast<double>(bytes) / wished_;
}

// A frame that closely followed another one took the link from the other one's end on. Any other frame also took a
// round trip, so its rate is at most the link's.
void SlicePace::acknowledged(FrameId frame, double now_s) {
  const auto found =
      std::find_if(under_way_.begin(), under_way_.end(), [&](const Sent& s) { return s.frame == frame; });
  if (found == under_way_.end()) return;
  const double took_s = now_s - std::max(found->sent_s, last_s_);
  const auto bytes = static_cast<double>(found->bytes);
  const bool tells = !found->again && took_s >= kLeast_s;
  under_way_.erase(found);
  last_s_ = now_s;
  if (!tells) return;
  if (now_s - window_s_ > kWindow_s) before_ = most_, most_ = 0, window_s_ = now_s;
  most_ = std::max(most_, bytes / took_s);
}

double SlicePace::link_free_s() const {
  const double rate = rate_bytes_s();
  if (under_way_.empty() || rate <= 0) return 0;
  double bytes = 0;
  for (const Sent& s : under_way_) bytes += static_cast<double>(s.bytes);
  const double needs_s = bytes / rate;
  return needs_s < kShort_s ? 0 : std::max(under_way_.front().sent_s, last_s_) + kShare * needs_s;
}

}  // namespace telesplat::packer
