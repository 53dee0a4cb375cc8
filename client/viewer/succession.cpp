#include "client/viewer/succession.h"

#include <algorithm>
#include <iterator>

namespace telesplat::viewer {

void Succession::begin(std::shared_ptr<Received> next) {
  const std::lock_guard lock(mutex_);
  if (!entries_.empty() && !entries_.back().first) {
    dropped_.push_back(std::move(entries_.back().received));
    entries_.pop_back();
  }
  entries_.push_back({std::move(next), std::nullopt});
}

void Succession::on_update(RequestId request) {
  const std::lock_guard lock(mutex_);
  if (!entries_.empty() && !entries_.back().first) entries_.back().first = request;
}

void Succession::free_dropped() {
  std::vector<std::shared_ptr<Received>> free;  // freed after the lock is released
  const std::lock_guard lock(mutex_);
  // New holders come from at() only, so one that is held only here stays that way.
  const auto held = std::partition(dropped_.begin(), dropped_.end(), [](const auto& r) { return r.use_count() > 1; });
  free.assign(std::make_move_iterator(held), std::make_move_iterator(dropped_.end()));
  dropped_.erase(held, dropped_.end());
}

std::shared_ptr<Received> Succession::at(RequestId request) {
  const std::lock_guard lock(mutex_);
  while (entries_.size() > 1 && entries_[1].first && *entries_[1].first <= request) {
    dropped_.push_back(std::move(entries_.front().received));
    entries_.pop_front();
  }
  return entries_.empty() ? nullptr : entries_.front().received;
}

}  // namespace telesplat::viewer
