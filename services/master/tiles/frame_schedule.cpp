#include "services/master/tiles/frame_schedule.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace telesplat::master {

bool FrameSchedule::begin_view(EpochId epoch, bool turns_only) {
  const auto request = take_view(turns_only);
  if (!request) return false;
  if (cut_.coarse) begin_frame(epoch, *request, kCoarseStep);
  begin(begin_frame(epoch, *request, 1), {*request});
  return true;
}

FrameId FrameSchedule::begin_frame(EpochId epoch, const wire::ViewRequest& request, int step) {
  const geometry::Camera camera = step == 1 ? request.camera : geometry::subsample(request.camera, step);
  auto tiles = cut_.rows ? FrameTiles::of_rows(camera.width, camera.height)
                         : FrameTiles::of_squares(camera.width, camera.height, options().tile_size);
  frames_.push_back({next_frame(), epoch, request, step, camera, std::move(tiles)});
  return frames_.back().id;
}

bool FrameSchedule::tile_open() const {
  return std::any_of(frames_.begin(), frames_.end(), [](const Frame& f) { return f.tiles.open(); });
}

bool FrameSchedule::backup_due(double now_s) const {
  const double before_s = now_s - backup_after_s();
  return std::any_of(frames_.begin(), frames_.end(),
                     [&](const Frame& f) { return !f.tiles.open() && f.tiles.overdue(before_s, nullptr); });
}

std::optional<wire::Lease> FrameSchedule::lease(const std::string& sampler, double now_s, bool even_own, bool idle) {
  costs_.join(sampler);
  const double pixel_s = costs_.pixel_s(sampler);
  const double target_s = std::max(options().lease_target_s, kTargetPerSampler_s * double(costs_.samplers()));
  for (Frame& f : frames_) {
    const double row_s = pixel_s * f.camera.width;
    // The last rows, one a sampler, go to those who have nothing else: kept for later by one who is busy they would
    // keep all waiting.
    const bool last = &f == &frames_.back() && f.tiles.rows_left() > 0 && f.tiles.rows_left() <= int(costs_.samplers());
    if (last && !idle && (row_s == 0 || row_s > kDearRow_s) && leases_of(sampler) > 0) continue;
    const int rows = band_rows(target_s, row_s, f.tiles.rows_left(), costs_.samplers());
    if (const auto tile = f.tiles.take(sampler, rows, even_own)) return lease_tile(f, *tile, sampler, now_s);
    if (f.tiles.open()) continue;
    // A frame is finished before the next is fed: what is out too long gets a second sampler.
    if (const auto tile = f.tiles.overdue(now_s - backup_after_s(), &sampler)) {
      ++backups_;
      return lease_tile(f, *tile, sampler, now_s);
    }
  }
  return std::nullopt;
}

wire::Lease FrameSchedule::lease_tile(Frame& f, size_t tile, const std::string& sampler, double now_s) {
  const LeaseId id = next_lease();
  f.tiles.lease(tile, id, sampler, now_s, now_s + lease_time_s());
  const auto& t = f.tiles.tile(tile);
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
          .leased_s = now_s};
}

void FrameSchedule::extend(LeaseId lease, double now_s) {
  for (Frame& f : frames_)
    if (f.tiles.extend(lease, now_s, now_s + options().lease_timeout_s)) return;
  if (const auto o = overtaken_.find(lease); o != overtaken_.end())
    o->second.expires_s = now_s + options().lease_timeout_s;
}

bool FrameSchedule::tile_done(const wire::TileDone& m, const std::string& sampler, double now_s) {
  const auto f = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.id == m.frame; });
  if (f == frames_.end()) return false;
  if (m.tile >= f->tiles.tiles()) return false;
  std::optional<double> took_s;
  if (const auto* out = f->tiles.out(m.lease); out && out->tile == m.tile) took_s = now_s - out->leased_s;
  for (const LeaseId id : f->tiles.tile(m.tile).leases)
    if (const auto* out = f->tiles.out(id); out && id != m.lease) overtaken_[id] = {out->sampler, out->expires_s};
  if (!f->tiles.done(m.tile)) return false;
  if (took_s) tile_time_s_.add(*took_s);
  const auto& rect = f->tiles.tile(m.tile).rect;
  costs_.learn(sampler, m.encode_end_s - m.sample_begin_s, double(rect.width) * rect.height);
  if (f->tiles.complete()) end_frame(f);
  return true;
}

void FrameSchedule::end_frame(std::deque<Frame>::iterator frame) {
  const bool whole = frame->step == 1;
  const auto viewer = frame->request.viewer;
  const auto request = frame->request.request;
  if (whole) complete(frame->id);
  frames_.erase(frame);
  if (!whole) return;
  // A coarse frame that is not there yet shows nothing any more.
  std::erase_if(frames_, [&](const Frame& f) {
    return f.step != 1 && f.request.viewer == viewer && f.request.request == request;
  });
}

double FrameSchedule::lease_time_s() const {
  const double longest_s = options().lease_timeout_s;
  return tile_time_s_.known() ? std::clamp(25 * tile_time_s_.value(), std::min(0.3, longest_s), longest_s) : longest_s;
}

double FrameSchedule::backup_after_s() const {
  return tile_time_s_.known() ? std::max(3 * tile_time_s_.value(), kLeastOverdue_s)
                              : std::numeric_limits<double>::infinity();
}

void FrameSchedule::heard_of(const std::string& sampler) {
  std::erase_if(overtaken_, [&](const auto& o) { return o.second.sampler == sampler; });
}

int FrameSchedule::expire(double now_s, const std::function<void(const std::string&)>& lost_sampler) {
  int count = 0;
  for (Frame& f : frames_) count += f.tiles.expire(now_s, lost_sampler);
  count += int(std::erase_if(overtaken_, [&](const auto& o) {
    if (now_s <= o.second.expires_s) return false;
    lost_sampler(o.second.sampler);
    return true;
  }));
  released_ += uint64_t(count);
  return count;
}

int FrameSchedule::release_sampler(const std::string& sampler) {
  costs_.leave(sampler);
  int count = 0;
  for (Frame& f : frames_) count += f.tiles.release(sampler);
  count += int(std::erase_if(overtaken_, [&](const auto& o) { return o.second.sampler == sampler; }));
  released_ += uint64_t(count);
  return count;
}

size_t FrameSchedule::leases_of(const std::string& sampler) const {
  size_t count = 0;
  for (const Frame& f : frames_) count += f.tiles.leases_of(sampler);
  for (const auto& [id, o] : overtaken_) count += o.sampler == sampler;
  return count;
}

void FrameSchedule::drop_frames() {
  // Newest first, each view once.
  for (auto f = frames_.rbegin(); f != frames_.rend(); ++f)
    if (f->step == 1) put_back(f->id);
  frames_.clear();
  overtaken_.clear();
}

}  // namespace telesplat::master
