#include "client/viewer/slices/cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <span>

namespace telesplat::viewer {
namespace {

geometry::Rect hull(const geometry::Rect& a, const geometry::Rect& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

uint64_t pixels_of(const geometry::Rect& r) { return uint64_t(r.width) * uint64_t(r.height); }

// Counts the pixels of all images, and of the layers into which they are merged.
uint64_t pixels_claimed(std::span<const volume::EncodedSlice> slices, const volume::ShearFrame& shear) {
  uint64_t pixels = 0;
  std::map<int, geometry::Rect> layers;
  for (const auto& slice : slices) {
    const geometry::Rect rect = volume::bounds(slice, shear.width, shear.height);
    pixels += pixels_of(rect);
    const auto [layer, first] = layers.try_emplace(slice.layer, rect);
    if (!first) layer->second = hull(layer->second, rect);
  }
  for (const auto& [layer, rect] : layers) pixels += pixels_of(rect);
  return pixels;
}

}  // namespace

Result<BufferedFrame> decode_frame(const wire::SliceFrame& f, const volume::Grid& grid,
                                   std::vector<volume::SliceImage>& images) {
  if (const Status s = geometry::validate(f.camera); !s) return s.error();
  if (const Status s = volume::validate(f.shear, grid); !s) return s.error();
  const std::span bytes(reinterpret_cast<const uint8_t*>(f.data.data()), f.data.size());
  const auto slices = volume::parse_slices(bytes, f.shear.width, f.shear.height, int(f.shear.layers.size()));
  if (!slices) return slices.error();
  if (const uint64_t pixels = pixels_claimed(*slices, f.shear); pixels > kMaxSlicePixels)
    return Error{fmt::format("its images have {} pixels; at most {}", pixels, kMaxSlicePixels)};
  images.resize(slices->size());
  for (size_t i = 0; i < images.size(); ++i)
    if (const Status s = volume::decode_slice_into(images[i], (*slices)[i], f.shear.width, f.shear.height); !s)
      return s.error();
  BufferedFrame out;
  out.frame = std::make_shared<const volume::VolumeFrame>(
      volume::make_volume_frame(grid, f.shear, images, f.frame, f.epoch, f.data.size()));
  out.update = {f.request, f.moments.requested_s, f.camera.pose};
  out.pixels = out.frame->pixels();
  return out;
}

void SliceCache::show(BufferedFrame frame) {
  if (displayed_.frame) dropped_.push_back(std::move(displayed_.frame));
  displayed_ = std::move(frame);
}

void SliceCache::put(BufferedFrame frame) {
  const std::lock_guard lock(mutex_);
  ++frames_;
  newest_source_ = frame.source;
  newest_ = frame.frame->frame;
  if (in_order_ || in_step_)
    waiting_.push_back(std::move(frame));
  else
    show(std::move(frame));
  if (in_order_ || waiting_.size() <= kMostInStep) return;
  show(std::move(waiting_.front()));
  waiting_.pop_front();
}

void SliceCache::show_until(InstanceId source, FrameId frame) {
  const std::lock_guard lock(mutex_);
  if (in_order_) return;
  const auto shown = [&](const BufferedFrame& f) { return f.source == source && f.frame->frame <= frame; };
  const auto last = std::find_if(waiting_.rbegin(), waiting_.rend(), shown);
  for (auto n = waiting_.rend() - last; n > 0; --n) {
    show(std::move(waiting_.front()));
    waiting_.pop_front();
  }
}

SliceCache::Newest SliceCache::newest() const {
  const std::lock_guard lock(mutex_);
  Newest out{newest_source_, newest_};
  const auto add = [&](const BufferedFrame& f) {
    if (!f.frame || f.source != newest_source_ || f.frame->frame > newest_) return;
    if (const uint64_t before = newest_.value - f.frame->frame.value; before < 64) out.held |= uint64_t{1} << before;
  };
  add(displayed_);
  for (const BufferedFrame& f : waiting_) add(f);
  return out;
}

void SliceCache::free_dropped() {
  std::vector<std::shared_ptr<const volume::VolumeFrame>> free;  // freed after the lock is released
  const std::lock_guard lock(mutex_);
  // New holders come from displayed() only, so a frame that is held only here stays that way.
  const auto held = std::partition(dropped_.begin(), dropped_.end(), [](const auto& f) { return f.use_count() > 1; });
  free.assign(std::make_move_iterator(held), std::make_move_iterator(dropped_.end()));
  dropped_.erase(held, dropped_.end());
}

std::vector<FrameId> SliceCache::take_left() {
  std::vector<FrameId> out;
  const std::lock_guard lock(mutex_);
  out.swap(left_);
  return out;
}

void SliceCache::set_in_order(bool in_order) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(in_order_, in_order) == in_order || in_order) return;
  if (in_step_) {
    for (const BufferedFrame& f : waiting_) left_.push_back(f.frame->frame);
    if (!std::exchange(counted_, true)) left_.push_back(displayed_.frame->frame);
    return;
  }
  if (!std::exchange(counted_, true)) left_.push_back(displayed_.frame->frame);
  for (BufferedFrame& f : waiting_) {
    left_.push_back(f.frame->frame);
    show(std::move(f));
  }
  waiting_.clear();
}

BufferedFrame SliceCache::displayed() const {
  const std::lock_guard lock(mutex_);
  return displayed_;
}

void SliceCache::advance(RequestId request) {
  const std::lock_guard lock(mutex_);
  const auto next = std::find_if(waiting_.begin(), waiting_.end(),
                                 [&](const BufferedFrame& f) { return f.update.request == request; });
  if (next == waiting_.end()) return;
  for (auto f = waiting_.begin(); f != next; ++f) {
    left_.push_back(f->frame->frame);
    dropped_.push_back(std::move(f->frame));
  }
  if (!counted_) left_.push_back(displayed_.frame->frame);
  show(std::move(*next));
  counted_ = false;
  waiting_.erase(waiting_.begin(), std::next(next));
}

void SliceCache::frame_done() {
  const std::lock_guard lock(mutex_);
  if (counted_) return;
  left_.push_back(displayed_.frame->frame);
  counted_ = true;
}

SliceCache::Figures SliceCache::figures() const {
  const std::lock_guard lock(mutex_);
  Figures out{frames_, waiting_.size(), displayed_.pixels, 0};
  for (const auto& f : waiting_) out.pixels += f.pixels;
  out.bytes = out.pixels * sizeof(uint32_t);
  return out;
}

}  // namespace telesplat::viewer
