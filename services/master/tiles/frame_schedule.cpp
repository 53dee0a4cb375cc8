#include "services/master/tiles/frame_schedule.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace telesplat::master {
namespace {

wire::Moments leased(wire::Moments moments, double now_s) {
  moments.leased_s = now_s;
  return moments;
}

}  // namespace

bool FrameSchedule::begin_view(EpochId epoch, bool turns_only, double now_s) {
  const bool steered = plans_.on(now_s);
  in_turns_ = turns_only;
  const auto ready = [&](InstanceId viewer) { return open(viewer, now_s); };
  // With plans, each viewer has one view in flight: the next view's plan must know its samples.
  const auto request = take_view(turns_only, now_s, steered ? InFlight::kOneAViewer : InFlight::kAny, ready);
  if (!request) return false;
  close_extras(*request, now_s);
  PlannedView view{.epoch = epoch, .view = *request};
  view.view.moments.begun_s = now_s, view.view.moments.planned_s = 0;
  if (arrives_coarse(*request)) view.coarse = next_frame();
  view.frame = next_frame();
  begin(view.frame, {*request});
  if (steered) {
    questions_.push_back(plans_.ask(view, limits(*request, now_s), now_s));
  } else {
    plans_.begin_unplanned(view);
    begin_whole(view);
  }
  return true;
}

void FrameSchedule::begin_whole(const PlannedView& view, int times) {
  geometry::Camera camera = view.view.camera;
  camera.width = std::max(camera.width / times, 1), camera.height = std::max(camera.height / times, 1);
  if (view.coarse.value != 0 && times == 1)
    begin_frame(view, view.coarse, geometry::subsample(camera, kCoarseStep), kCoarseStep);
  begin_frame(view, view.frame, camera, 1);
}

void FrameSchedule::begin_frame(const PlannedView& view, FrameId id, const geometry::Camera& camera, int step) {
  auto tiles = cut_.rows       ? FrameTiles::of_rows(camera.width, camera.height)
               : cut_.pictures ? FrameTiles::of_bands(camera.width, camera.height, workers())
                               : FrameTiles::of_squares(camera.width, camera.height, options().tile_size);
  const wire::Moments& m = view.view.moments;
  insert({.id = id,
          .epoch = view.epoch,
          .request = view.view,
          .step = step,
          .camera = camera,
          .tiles = std::move(tiles),
          .begun_s = std::max(m.begun_s, m.planned_s)});
}

void FrameSchedule::insert(Frame frame) {
  const auto place = frame.extra ? frames_.end()
                                 : std::find_if(frames_.begin(), frames_.end(), [](const Frame& f) { return f.extra; });
  frames_.insert(place, std::move(frame));
}

bool FrameSchedule::tile_open() const {
  return std::any_of(frames_.begin(), frames_.end(), [](const Frame& f) { return f.tiles.open(); });
}

bool FrameSchedule::backup_due(double now_s) const {
  const auto trusts = [&](const std::string& sampler) { return this->trusts(sampler, now_s); };
  return std::any_of(frames_.begin(), frames_.end(), [&](const Frame& f) {
    return !f.extra && !f.tiles.open() && f.tiles.overdue(now_s - backup_after_s(f.planned), nullptr, trusts);
  });
}

bool FrameSchedule::trusted_here(double now_s) const {
  const auto has = [&](const std::string& sampler) { return trust_.has(sampler); };
  return trust_.lately(now_s) ||
         std::any_of(frames_.begin(), frames_.end(), [&](const Frame& f) { return f.tiles.any_out(has); });
}

std::vector<Trust::News> FrameSchedule::take_news(double now_s) {
  return trust_.news(now_s, [this](const std::string& sampler) {
    return leases_of(sampler) > 0 || std::any_of(overtaken_.begin(), overtaken_.end(),
                                                 [&](const auto& o) { return o.second.sampler == sampler; });
  });
}

double FrameSchedule::target_s() const {
  return std::max(options().lease_target_s, kTargetPerSampler_s * double(workers()));
}

std::optional<wire::Lease> FrameSchedule::lease(const std::string& sampler, double now_s, bool even_own, bool idle) {
  costs_.join(sampler);
  const bool trusted_here = this->trusted_here(now_s);
  if (trusted_here && !trust_.has(sampler)) {
    if (leases_of(sampler) > 0) return std::nullopt;
    if (trust_.has_failed(sampler)) return lease_copy(sampler, now_s);
  }
  const auto trusts = [&](const std::string& other) { return !trusted_here || trust_.has(other); };
  const double pixel_s = costs_.pixel_s(sampler);
  const auto extras = std::find_if(frames_.rbegin(), frames_.rend(), [](const Frame& f) { return !f.extra; });
  const Frame* newest = extras == frames_.rend() ? nullptr : &*extras;  // newest frame of a view
  for (Frame* frame : in_turn(now_s)) {
    Frame& f = *frame;
    if (!may_lease(f, now_s)) continue;
    const double row_s = pixel_s * f.camera.width;
    // The last rows, one for each sampler, go to samplers that hold no other lease: all would wait for a busy one that
    // kept them for later.
    const bool last = &f == newest && f.tiles.rows_left() > 0 && f.tiles.rows_left() <= int(workers());
    if (last && !idle && (row_s == 0 || row_s > kDearRow_s) && leases_of(sampler) > 0) continue;
    const int rows = band_rows(target_s(), row_s, f.tiles.rows_left(), workers());
    if (const auto tile = f.tiles.take(sampler, rows, even_own)) return lease_tile(f, *tile, sampler, now_s);
    if (f.tiles.open() || f.extra) continue;
    // A frame is finished before the next one gets samplers: a tile that is out too long goes to a second sampler.
    if (const auto tile = f.tiles.overdue(now_s - backup_after_s(f.planned), &sampler, trusts)) {
      ++backups_;
      return lease_tile(f, *tile, sampler, now_s);
    }
  }
  return std::nullopt;
}

// Orders frames for leases: frames of persons who spent less go first; of one person's frames, the oldest does.
std::vector<FrameSchedule::Frame*> FrameSchedule::in_turn(double now_s) {
  std::vector<Frame*> out;
  for (Frame& f : frames_) out.push_back(&f);
  const auto spent = [&](const Frame* f) { return spending().spent(f->request.viewer, now_s); };
  std::stable_sort(out.begin(), out.end(), [&](const Frame* a, const Frame* b) {
    return a->extra != b->extra ? b->extra : !a->extra && spent(a) < spent(b);
  });
  return out;
}

// Lets a failed sampler show that it delivers, with a tile that a trusted one has: no frame waits for it.
std::optional<wire::Lease> FrameSchedule::lease_copy(const std::string& sampler, double now_s) {
  const auto trusts = [&](const std::string& other) { return trust_.has(other); };
  for (Frame& f : frames_)
    if (const auto tile = f.tiles.to_copy(trusts)) return lease_tile(f, *tile, sampler, now_s);
  return std::nullopt;
}

wire::Lease FrameSchedule::lease_tile(Frame& f, size_t tile, const std::string& sampler, double now_s) {
  const LeaseId id = next_lease();
  // A sampler that has not finished a tile may have to fetch its data first, and to arrange it.
  const double time_s = costs_.knows(sampler) ? lease_time_s(f.planned) : options().lease_timeout_s;
  f.tiles.lease(tile, id, sampler, now_s, now_s + time_s);
  spending().spend(f.request.viewer, double(f.tiles.tile(tile).rays), now_s);
  const auto& t = f.tiles.tile(tile);
  const auto mask = f.tiles.mask(t);
  return {.lease = id,
          .frame = f.id,
          .epoch = f.epoch,
          .viewer = f.request.viewer,
          .request = f.request.request,
          .tile = tile,
          .step = uint64_t(f.step),
          .block = t.block,
          .blocks_in_frame = f.tiles.blocks().size(),
          .camera = f.camera,
          .rect = t.rect,
          .block_rect = f.tiles.blocks()[t.block],
          .extra = f.extra,
          .rays = t.rays,
          .mask = {mask.begin(), mask.end()},
          .footprint = f.request.footprint > 0 ? f.request.footprint : 1 / f.request.camera.focal_x(),
          .moments = leased(f.request.moments, now_s)};
}

void FrameSchedule::extend(LeaseId lease, const std::string& sampler, double now_s) {
  const auto until_s = [&](double leased_s, double expires_s) {
    const double longest_s = std::max(leased_s + options().longest_fetch_s, expires_s);
    return std::min(now_s + options().lease_timeout_s, longest_s);
  };
  for (Frame& f : frames_)
    if (const auto* out = f.tiles.out(lease)) {
      f.tiles.extend(lease, sampler, now_s, until_s(out->leased_s, out->expires_s));
      return;
    }
  if (const auto o = overtaken_.find(lease); o != overtaken_.end() && o->second.sampler == sampler)
    o->second.expires_s = until_s(o->second.leased_s, o->second.expires_s);
}

void FrameSchedule::refused(const wire::TileRefused& m, const std::string& sampler, double now_s) {
  trust_.failed(sampler, now_s);
  for (Frame& f : frames_)
    if (f.id == m.frame && f.tiles.refuse(m.tile, sampler) > 0) break;
  end_hopeless();
}

// Ends frames with a tile that cannot be had: they would hold up their viewer, and one of the few places in flight.
void FrameSchedule::end_hopeless() {
  for (Frame& f : frames_)
    if (!f.tiles.closed() && f.tiles.hopeless(kMostRefused, kMostLost)) {
      f.tiles.close();
      ++given_up_;
    }
  end_closed();
}

// A tile that another sampler delivered first counts as well: a slow sampler does deliver.
void FrameSchedule::note_delivery(const wire::TileDone& m, const std::string& sampler, double now_s) {
  const auto held = [&](const Frame& f) {
    const auto* out = f.tiles.out(m.lease);
    return out && out->sampler == sampler;
  };
  const auto late = overtaken_.find(m.lease);
  const bool was_late = late != overtaken_.end() && late->second.sampler == sampler;
  if (was_late) overtaken_.erase(late);
  if (was_late || std::any_of(frames_.begin(), frames_.end(), held)) trust_.delivered(sampler, now_s);
}

bool FrameSchedule::tile_done(const wire::TileDone& m, const std::string& sampler, double now_s) {
  note_delivery(m, sampler, now_s);
  const auto f = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.id == m.frame; });
  // A block's bytes are counted with its last tile; in plans, and in views in squares, a block is a tile.
  const bool known = f != frames_.end() && f->tiles.whole_blocks() && f->step == 1 && m.tile < f->tiles.tiles();
  if (known && !f->planned)
    gate_.published(m.bytes_sent, f->tiles.tile(m.tile).rays, now_s, LinkGate::Rays::kAll);
  else
    gate_.published(m.bytes_sent, known ? m.rays : 0, now_s);
  if (f == frames_.end()) return false;
  if (m.tile >= f->tiles.tiles()) return false;
  std::optional<double> took_s;
  if (const auto* out = f->tiles.out(m.lease); out && out->tile == m.tile) took_s = now_s - out->leased_s;
  for (const LeaseId id : f->tiles.tile(m.tile).leases)
    if (const auto* out = f->tiles.out(id); out && id != m.lease) {
      overtaken_[id] = {out->sampler, out->leased_s, out->expires_s};
      if (now_s - out->leased_s > backup_after_s(f->planned)) trust_.failed(out->sampler, now_s);
    }
  if (!f->tiles.done(m.tile)) return false;
  if (took_s) (f->planned ? planned_time_s_ : tile_time_s_).add(*took_s);
  // A sampler that cannot read a mask casts all pixels.
  const auto& tile = f->tiles.tile(m.tile);
  const uint64_t all = uint64_t(tile.rect.width) * uint64_t(tile.rect.height);
  const double work_s = m.moments.encode_end_s - m.moments.sample_begin_s;
  costs_.learn(sampler, work_s, double(std::clamp(m.rays, tile.rays, all)));
  if (!f->planned && work_s > 0) whole_ray_s_.add(work_s / double(all));
  if (!f->tiles.complete()) return true;
  if (f->planned && !f->extra && !f->tiles.closed())
    refining_.learn(now_s - f->begun_s, f->refining, f->put_off, std::max<size_t>(workers(), 1));
  end_frame(f);
  return true;
}

std::deque<FrameSchedule::Frame>::iterator FrameSchedule::end_frame(std::deque<Frame>::iterator frame) {
  const bool view = frame->step == 1 && !frame->extra;
  const PlannedView ended{.frame = frame->id, .epoch = frame->epoch, .view = frame->request};
  if (!view) return frames_.erase(frame);
  if (left(frame->id)) {  // no viewer waits for what is missing
    frames_.erase(frame);
    complete(ended.frame, false);
    return frames_.end();
  }
  const bool whole = frame->tiles.left() == 0;
  if (!whole) {
    overtaken_views_ += !frame->tiles.hopeless(kMostRefused, kMostLost);
    ends_.push_back({.frame = frame->id,
                     .epoch = frame->epoch,
                     .viewer = frame->request.viewer,
                     .request = frame->request.request,
                     .tiles = frame->tiles.blocks().size(),
                     .camera = frame->camera,
                     .moments = frame->request.moments});
  }
  frames_.erase(frame);
  view_complete(ended, whole);
  // The view's coarse frame, if it is not complete yet, has nothing to show any more.
  std::erase_if(frames_, [&](const Frame& f) {
    return f.step != 1 && f.request.viewer == ended.view.viewer && f.request.request == ended.view.request;
  });
  return frames_.end();
}

double FrameSchedule::lease_time_s(bool planned) const {
  const double longest_s = options().lease_timeout_s;
  const RunningMean& typical = planned ? planned_time_s_ : tile_time_s_;
  return typical.known() ? std::clamp(25 * typical.value(), std::min(0.3, longest_s), longest_s) : longest_s;
}

double FrameSchedule::backup_after_s(bool planned) const {
  const RunningMean& typical = planned ? planned_time_s_ : tile_time_s_;
  return typical.known() ? std::max(3 * typical.value(), kLeastOverdue_s) : std::numeric_limits<double>::infinity();
}

void FrameSchedule::heard_of(const std::string& sampler) {
  for (auto& [id, o] : overtaken_) o.heard |= o.sampler == sampler;
}

int FrameSchedule::expire(double now_s, const std::function<void(const std::string&)>& lost_sampler) {
  int count = 0;
  const auto lost = [&](const std::string& sampler) {
    ++count;
    trust_.failed(sampler, now_s);
    lost_sampler(sampler);
  };
  for (Frame& f : frames_) f.tiles.expire(now_s, lost);
  std::erase_if(overtaken_, [&](const auto& o) {
    if (now_s <= o.second.expires_s) return false;
    if (!o.second.heard) lost(o.second.sampler);
    return true;
  });
  released_ += uint64_t(count);
  end_hopeless();
  put_back_held(now_s);
  return count;
}

int FrameSchedule::release_sampler(const std::string& sampler) {
  costs_.leave(sampler);
  trust_.leave(sampler);
  int count = 0;
  for (Frame& f : frames_) count += f.tiles.release(sampler);
  count += int(std::erase_if(overtaken_, [&](const auto& o) { return o.second.sampler == sampler; }));
  released_ += uint64_t(count);
  end_hopeless();
  return count;
}

size_t FrameSchedule::leases_of(const std::string& sampler) const {
  size_t count = 0;
  for (const Frame& f : frames_) count += f.tiles.leases_of(sampler);
  for (const auto& [id, o] : overtaken_) count += !o.heard && o.sampler == sampler;
  return count;
}

void FrameSchedule::drop_frames() {
  // Put back the newest view first, each view once.
  const auto& open = plans_.open();
  for (auto asked = open.rbegin(); asked != open.rend(); ++asked)
    if (!asked->request.extra) put_back(asked->view.frame);
  for (auto f = frames_.rbegin(); f != frames_.rend(); ++f)
    if (f->step == 1 && !f->extra) put_back(f->id);
  frames_.clear();
  overtaken_.clear();
  plans_.clear();
  questions_.clear();
  ends_.clear();
}

// ---- views that wait for viewers' links, and views that waited too long --------------------------------------------

bool FrameSchedule::may_lease(const Frame& f, double now_s) const {
  return open(f.request.viewer, now_s) && (!f.extra || gate_.idle(now_s));
}

// A view that a link would carry for long arrives coarse first, so that there is something to see.
bool FrameSchedule::arrives_coarse(const wire::ViewRequest& view) const {
  if (cut_.coarse) return true;
  const auto pixels = static_cast<double>(view.camera.width) * static_cast<double>(view.camera.height);
  return cut_.coarse_if_slow && gate_.takes_s(view.viewer, pixels).value_or(0) > kCoarseFrom_s;
}

// To end such a view loses nothing: what came stays, and the newer view's plan asks for what that view still lacks.
bool FrameSchedule::is_overtaken(const Frame& f, double now_s) const {
  if (f.extra || f.step != 1 || f.request.buffers > 0 || open(f.request.viewer, now_s)) return false;
  if (!f.tiles.open() || !f.tiles.whole_blocks() || now_s - f.begun_s < kOvertaken_s) return false;
  const wire::ViewRequest* newer = waiting_of(f.request.viewer);
  if (!newer || newer->camera == f.request.camera) return false;
  return std::none_of(frames_.begin(), frames_.end(), [&](const Frame& coarse) {
    return coarse.step != 1 && coarse.request.viewer == f.request.viewer && coarse.request.request == f.request.request;
  });
}

void FrameSchedule::end_overtaken(double now_s) {
  for (Frame& f : frames_)
    if (is_overtaken(f, now_s)) f.tiles.close();
  end_closed();
}

std::vector<wire::FrameEnd> FrameSchedule::take_ends(double now_s) {
  for (wire::FrameEnd& end : ends_) end.moments.leased_s = now_s;  // the tiles left out waited until now
  return std::exchange(ends_, {});
}

// True if a view of another viewer waits, and that viewer's link takes more.
bool FrameSchedule::other_waits(InstanceId viewer, double now_s) const {
  return view_waits([&](InstanceId other) { return other != viewer && gate_.open(other, now_s); });
}

// Puts back views whose links take nothing, but only to let other viewers begin: their samples are made, and sent, once
// more. Tiles of such a frame that are out still come; its viewer's requests wait until the link takes more.
void FrameSchedule::put_back_held(double now_s) {
  std::vector<wire::ViewRequest> held;
  for (Frame& f : frames_) {
    if (f.extra || !f.tiles.open() || f.tiles.any_out() || open(f.request.viewer, now_s))
      f.held_from_s = 0;
    else if (f.held_from_s == 0)
      f.held_from_s = now_s;
    else if (f.step == 1 && now_s - f.held_from_s > kHeld_s && other_waits(f.request.viewer, now_s))
      held.push_back(f.request);
  }
  for (const auto& view : held)
    std::erase_if(frames_, [&](const Frame& f) {
      if (f.extra || f.request.viewer != view.viewer || f.request.request != view.request) return false;
      if (f.step == 1) put_back(f.id);
      return true;
    });
}

}  // namespace telesplat::master
