#include "client/viewer/slices/cache.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace telesplat::viewer {

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
  // New holders come from displayed() only, so that a frame that nobody else holds stays that way.
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
