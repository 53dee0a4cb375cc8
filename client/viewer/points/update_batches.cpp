#include "client/viewer/points/update_batches.h"

#include <algorithm>

#include "common/core/log.h"

namespace telesplat::viewer {

void UpdateBatches::add(Change change, ModelCache& cache) {
  const std::lock_guard lock(mutex_);
  if (const auto* insert = std::get_if<Insert>(&change)) points_ += insert->patch.points;
  changes_.push_back(std::move(change));
  if (points_ <= kMaxPoints) return;
  log::warn("{} points wait for a view update that does not become complete: they are shown as they are", points_);
  while (!changes_.empty()) apply_front(cache);
  cache.show_newest();
}

void UpdateBatches::close(const ShownUpdate& update) {
  const std::lock_guard lock(mutex_);
  ends_.push_back({update, first_ + changes_.size()});
}

// Of a replica that begins: whether an older one stays on display.
bool UpdateBatches::apply_front(ModelCache& cache) {
  bool held = false;
  std::visit(
      [&](auto& c) {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, Insert>) {
          points_ -= c.patch.points;
          cache.insert(std::move(c.patch), c.epoch);
        } else if constexpr (std::is_same_v<C, Forget>) {
          cache.forget(c.sequence, c.clusters, c.frames);
        } else {
          held = cache.begin_replica(c.config, c.epoch, c.sequence);
        }
      },
      changes_.front());
  changes_.pop_front();
  ++first_;
  return held;
}

std::optional<ShownUpdate> UpdateBatches::release(ModelCache& cache, const std::function<void()>& shown,
                                                  const std::function<void(const Begin&, bool held)>& begun) {
  const std::lock_guard lock(mutex_);
  std::optional<ShownUpdate> newest;
  if (!ends_.empty()) {
    newest = ends_.back().update;
    while (!changes_.empty() && first_ < ends_.back().change) apply_front(cache);
    cache.show_newest();
    ends_.clear();
    shown();
  }
  while (!changes_.empty()) {
    const auto* begins = std::get_if<Begin>(&changes_.front());
    const Begin begin = begins ? *begins : Begin{};
    const bool is_begin = begins != nullptr, held = apply_front(cache);
    if (is_begin) begun(begin, held);
  }
  return newest;
}

std::optional<ShownUpdate> UpdateBatches::apply(RequestId request, ModelCache& cache) {
  const std::lock_guard lock(mutex_);
  const auto end = std::find_if(ends_.begin(), ends_.end(), [&](const End& e) { return e.update.request == request; });
  if (end == ends_.end()) return std::nullopt;
  const ShownUpdate update = end->update;
  const uint64_t until = end->change;
  ends_.erase(ends_.begin(), std::next(end));
  while (!changes_.empty() && first_ < until) apply_front(cache);
  cache.show_newest();
  return update;
}

}  // namespace telesplat::viewer
