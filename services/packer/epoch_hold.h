// Keeps what came ahead of the announcement of its epoch: tiles and announcements travel on different sockets.
#pragma once

#include <deque>
#include <utility>

namespace telesplat::packer {

template <class T>
class EpochHold {
 public:
  struct Limits {
    size_t items = 256, bytes = 64u << 20;  ///< beyond them the oldest are dropped
    double patience_s = 1;                  ///< what waited longer is dropped
  };
  EpochHold() = default;
  explicit EpochHold(const Limits& limits) : limits_(limits) {}

  /// since_s: when it came, on the clock of expire().
  void add(T item, size_t bytes, double since_s) {
    items_.push_back({std::move(item), bytes, since_s});
    bytes_ += bytes;
    while (items_.size() > limits_.items || bytes_ > limits_.bytes) drop();
  }
  /// Everything that waits, in the order in which it came; what must wait on is added again.
  struct Waiting {
    T item;
    size_t bytes;
    double since_s;
  };
  std::deque<Waiting> take() {
    bytes_ = 0;
    return std::exchange(items_, {});
  }
  void expire(double now_s) {
    while (!items_.empty() && now_s - items_.front().since_s > limits_.patience_s) drop();
  }
  bool empty() const { return items_.empty(); }
  size_t size() const { return items_.size(); }
  uint64_t dropped() const { return dropped_; }

 private:
  void drop() {
    bytes_ -= items_.front().bytes;
    items_.pop_front();
    ++dropped_;
  }

  Limits limits_;
  std::deque<Waiting> items_;
  size_t bytes_ = 0;
  uint64_t dropped_ = 0;
};

}  // namespace telesplat::packer
