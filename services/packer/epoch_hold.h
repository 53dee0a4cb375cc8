// Keeps what came ahead of the announcement of its epoch: tiles and announcements travel on different sockets.
#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace telesplat::packer {

template <class T>
class EpochHold {
 public:
  struct Limits {
    size_t items = 256, bytes = 64u << 20;  ///< beyond them the oldest of who has most are dropped
    double patience_s = 1;                  ///< what waited longer is dropped
  };
  EpochHold() = default;
  explicit EpochHold(const Limits& limits) : limits_(limits) {}

  /// since_s: when it came, on the clock of expire(). user: whose key it came by (net::Message::user).
  void add(T item, size_t bytes, double since_s, std::string user = {}) {
    items_.push_back({std::move(item), bytes, since_s, std::move(user)});
    bytes_ += bytes;
    while (items_.size() > limits_.items || bytes_ > limits_.bytes) drop(oldest_of_largest());
  }
  /// Everything that waits, in the order in which it came; what must wait on is added again.
  struct Waiting {
    T item;
    size_t bytes;
    double since_s;
    std::string user;
  };
  std::deque<Waiting> take() {
    bytes_ = 0;
    return std::exchange(items_, {});
  }
  void expire(double now_s) {
    while (!items_.empty() && now_s - items_.front().since_s > limits_.patience_s) drop(items_.begin());
  }
  bool empty() const { return items_.empty(); }
  size_t size() const { return items_.size(); }
  uint64_t dropped() const { return dropped_; }

 private:
  using At = typename std::deque<Waiting>::iterator;
  // Seals cannot be checked yet, so one key's tiles must not push out another's. Counts what there is too much of.
  At oldest_of_largest() {
    const bool counts = items_.size() > limits_.items;
    std::map<std::string_view, size_t> held;
    for (const Waiting& w : items_) held[w.user] += counts ? 1 : w.bytes;
    const auto most = std::ranges::max_element(held, {}, [](const auto& h) { return h.second; });
    return std::ranges::find(items_, most->first, &Waiting::user);
  }
  void drop(At at) {
    bytes_ -= at->bytes;
    items_.erase(at);
    ++dropped_;
  }

  Limits limits_;
  std::deque<Waiting> items_;
  size_t bytes_ = 0;
  uint64_t dropped_ = 0;
};

}  // namespace telesplat::packer
