// Orders of people to this viewer, on their way from the worker to the display, and their answers on their way back.
#pragma once

#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Thread-safe.
class OrderDesk {
 public:
  static constexpr size_t kMost = 64;  ///< that wait; the oldest goes, and its sender hears nothing

  struct Answer {
    uint64_t number = 0;
    bool ok = false;
    std::string text;
  };

  void put(const wire::Order& order) {
    const std::lock_guard lock(mutex_);
    orders_.push_back(order);
    if (orders_.size() > kMost) orders_.pop_front();
  }
  std::vector<wire::Order> take_orders() {
    const std::lock_guard lock(mutex_);
    std::vector<wire::Order> out(orders_.begin(), orders_.end());
    orders_.clear();
    return out;
  }
  void answer(Answer answer) {
    const std::lock_guard lock(mutex_);
    answers_.push_back(std::move(answer));
  }
  std::vector<Answer> take_answers() {
    const std::lock_guard lock(mutex_);
    return std::exchange(answers_, {});
  }

 private:
  std::mutex mutex_;
  std::deque<wire::Order> orders_;
  std::vector<Answer> answers_;
};

}  // namespace telesplat::viewer
