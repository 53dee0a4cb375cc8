// Processes that left long ago, for the run's record: the newest whole, the others counted.
#pragma once

#include <cstdint>
#include <deque>

#include "common/metrics/process.h"

namespace telesplat::master {

class Departed {
 public:
  static constexpr double kAfter_s = 60;  ///< so long those who left are told of among the others
  static constexpr size_t kMostKept = 1000;

  void add(metrics::Process process) {
    kept_.push_back(std::move(process));
    if (kept_.size() <= kMostKept) return;
    kept_.pop_front();
    ++forgotten_;
  }
  /// Oldest first.
  const std::deque<metrics::Process>& kept() const { return kept_; }
  uint64_t count() const { return kept_.size() + forgotten_; }
  uint64_t forgotten() const { return forgotten_; }

 private:
  std::deque<metrics::Process> kept_;
  uint64_t forgotten_ = 0;
};

}  // namespace telesplat::master
