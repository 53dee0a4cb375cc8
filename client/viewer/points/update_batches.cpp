#include "client/viewer/points/update_batches.h"

#include <algorithm>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

uint64_t sequence_of(const UpdateBatches::Change& change) {
  return std::visit(
      [](const auto& c) {
        if constexpr (requires { c.patch; })
          return c.patch.sequence.value;
        else if constexpr (requires { c.refinement; })
          return c.refinement.sequence.value;
        else
          return c.sequence.value;
      },
      change);
}

}  // namespace

void UpdateBatches::add(Change change, ModelCache& cache, InstanceId packer) {
  const std::lock_guard lock(mutex_);
  if (const auto* insert = std::get_if<Insert>(&change)) points_ += insert->patch.points;
  if (std::exchange(newest_.source, packer) != packer) newest_.replica = 0;
  newest_.newest = sequence_of(change);
  if (std::holds_alternative<Begin>(change)) {
    begun_ = newest_.newest + 1;
    begun_s_ = monotonic_s();
  }
  changes_.push_back({std::move(change), packer});
  if (points_ <= kMaxPoints) return;
  log::warn("{} points wait for a view update that does not become complete: they are shown as they are", points_);
  while (!changes_.empty()) apply_front(cache);
  cache.show_newest();
}

void UpdateBatches::complete(RequestId request) {
  const std::lock_guard lock(mutex_);
  complete_[request] = first_ + changes_.size();
}

void UpdateBatches::close(const ShownUpdate& update) {
  const std::lock_guard lock(mutex_);
  const auto found = complete_.find(update.request);
  uint64_t until = found == complete_.end() ? first_ + changes_.size() : found->second;
  if (!ends_.empty()) until = std::max(until, ends_.back().change);
  complete_.erase(complete_.begin(), complete_.upper_bound(update.request));
  ends_.push_back({update, until});
  newest_.replica = begun_;
}

wire::ShownState UpdateBatches::newest(double now_s) const {
  const std::lock_guard lock(mutex_);
  wire::ShownState out = newest_;
  if (now_s - begun_s_ > kReplicaPatience_s) out.replica = begun_;
  return out;
}

// If the change begins a replica, returns true if an older one stays on display.
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
        } else if constexpr (std::is_same_v<C, Refine>) {
          cache.refine(c.refinement);
        } else {
          applied_ = {changes_.front().packer, c.sequence.value, c.sequence.value + 1};
          held = cache.begin_replica(c.config, c.epoch, c.sequence);
        }
      },
      changes_.front().change);
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
    const auto* begins = std::get_if<Begin>(&changes_.front().change);
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

std::optional<ShownUpdate> UpdateBatches::apply_until(const wire::ShownState& state, ModelCache& cache) {
  const std::lock_guard lock(mutex_);
  const auto show = [&] {
    if (applied_.source == state.source && applied_.replica <= state.replica) cache.show_newest();
  };
  while (!changes_.empty()) {
    const Held& next = changes_.front();
    const uint64_t sequence = sequence_of(next.change);
    if (next.packer == state.source) {
      if (sequence > state.newest) break;
    } else if (std::none_of(changes_.begin(), changes_.end(),
                            [&](const Held& h) { return h.packer == state.source; })) {
      break;  // the others do not show this packer's model yet
    }
    // Show the replica before first, else it would be skipped.
    if (std::holds_alternative<Begin>(next.change)) show();
    apply_front(cache);
  }
  show();
  std::optional<ShownUpdate> out;
  while (!ends_.empty() && ends_.front().change <= first_) {
    out = ends_.front().update;
    ends_.pop_front();
  }
  return out;
}

}  // namespace telesplat::viewer
