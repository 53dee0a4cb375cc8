#include "services/master/frame_schedule.h"

#include <algorithm>
#include <cmath>

namespace telesplat::master {

std::vector<geometry::Rect> cut_tiles(int width, int height, int tile_size) {
  std::vector<geometry::Rect> out;
  for (int y = 0; y < height; y += tile_size)
    for (int x = 0; x < width; x += tile_size)
      out.push_back({x, y, std::min(tile_size, width - x), std::min(tile_size, height - y)});
  const auto distance = [&](const geometry::Rect& r) {
    return std::hypot(r.x + r.width / 2.0 - width / 2.0, r.y + r.height / 2.0 - height / 2.0);
  };
  std::stable_sort(out.begin(), out.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return out;
}

void FrameSchedule::request_view(const wire::ViewRequest& request) { waiting_[request.viewer] = request; }
void FrameSchedule::forget_viewer(InstanceId viewer) { waiting_.erase(viewer); }

bool FrameSchedule::begin_frame(EpochId epoch) {
  if (waiting_.empty() || frames_.size() >= size_t(options_.frames_in_flight)) return false;
  auto next = waiting_.upper_bound(last_viewer_);
  if (next == waiting_.end()) next = waiting_.begin();
  Frame frame{next_frame_, epoch, next->second, {}, 0};
  next_frame_ = next_frame_.next();
  last_viewer_ = next->first;
  waiting_.erase(next);
  // A hostile viewer could ask for a frame of very many tiles; larger tiles keep the count bounded.
  int size = options_.tile_size;
  const auto& camera = frame.request.camera;
  while (uint64_t((camera.width + size - 1) / size) * uint64_t((camera.height + size - 1) / size) > 1024) size *= 2;
  for (const auto& rect : cut_tiles(camera.width, camera.height, size)) frame.tiles.push_back({rect});
  frames_.push_back(std::move(frame));
  return true;
}

bool FrameSchedule::tile_open() const {
  for (const Frame& f : frames_)
    for (const Tile& t : f.tiles)
      if (t.state == State::kOpen) return true;
  return false;
}

std::optional<wire::Lease> FrameSchedule::lease(const std::string& sampler, EpochId epoch, double now_s) {
  do {
    for (Frame& f : frames_)
      for (size_t i = 0; i < f.tiles.size(); ++i) {
        Tile& t = f.tiles[i];
        if (t.state != State::kOpen) continue;
        t.state = State::kLeased;
        t.lease = next_lease_;
        t.sampler = sampler;
        t.leased_s = now_s;
        t.expires_s = now_s + lease_time_s();
        next_lease_ = next_lease_.next();
        return wire::Lease{.lease = t.lease,
                           .frame = f.id,
                           .epoch = f.epoch,
                           .viewer = f.request.viewer,
                           .request = f.request.request,
                           .tile = i,
                           .block = i,
                           .blocks_in_frame = f.tiles.size(),
                           .camera = f.request.camera,
                           .rect = t.rect,
                           .block_rect = t.rect,
                           .leased_s = now_s};
      }
  } while (begin_frame(epoch));
  return std::nullopt;
}

void FrameSchedule::extend(LeaseId lease, double now_s) {
  for (Frame& f : frames_)
    for (Tile& t : f.tiles)
      if (t.state == State::kLeased && t.lease == lease) t.expires_s = now_s + options_.lease_timeout_s;
}

bool FrameSchedule::tile_done(FrameId id, uint64_t tile, double now_s) {
  const auto f = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.id == id; });
  if (f == frames_.end() || tile >= f->tiles.size() || f->tiles[tile].state == State::kDone) return false;
  Tile& t = f->tiles[tile];
  if (t.state == State::kLeased)
    tile_time_s_ = tile_time_s_ == 0 ? now_s - t.leased_s : 0.95 * tile_time_s_ + 0.05 * (now_s - t.leased_s);
  t.state = State::kDone;
  if (++f->done == f->tiles.size()) {
    frames_.erase(f);
    ++completed_;
  }
  return true;
}

double FrameSchedule::lease_time_s() const {
  if (tile_time_s_ == 0) return options_.lease_timeout_s;
  return std::clamp(25 * tile_time_s_, std::min(0.3, options_.lease_timeout_s), options_.lease_timeout_s);
}

int FrameSchedule::expire(double now_s, const std::function<void(const std::string&)>& lost_sampler) {
  int count = 0;
  for (Frame& f : frames_)
    for (Tile& t : f.tiles)
      if (t.state == State::kLeased && now_s > t.expires_s) {
        lost_sampler(t.sampler);
        t.state = State::kOpen;
        ++count;
      }
  released_ += uint64_t(count);
  return count;
}

int FrameSchedule::release_sampler(const std::string& sampler) {
  int count = 0;
  for (Frame& f : frames_)
    for (Tile& t : f.tiles)
      if (t.state == State::kLeased && t.sampler == sampler) {
        t.state = State::kOpen;
        ++count;
      }
  released_ += uint64_t(count);
  return count;
}

size_t FrameSchedule::leases_of(const std::string& sampler) const {
  size_t count = 0;
  for (const Frame& f : frames_)
    count += size_t(std::count_if(f.tiles.begin(), f.tiles.end(),
                                  [&](const Tile& t) { return t.state == State::kLeased && t.sampler == sampler; }));
  return count;
}

void FrameSchedule::drop_frames() { frames_.clear(); }

}  // namespace telesplat::master
