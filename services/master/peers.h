// What the master knows of processes: who may take part, under which name, how often it speaks, and who left.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/metrics/process.h"
#include "common/wire/session_messages.h"

namespace telesplat::master {

// How often something may be done: some times in a row, then so often a second. No clocks.

class Pace {
 public:
  Pace(double in_a_row, double rate_s) : in_a_row_(in_a_row), rate_s_(rate_s), left_(in_a_row) {}

  bool allows(double now_s) const { return left(now_s) >= 1; }
  /// It is done, allowed or not.
  void count(double now_s) {
    left_ = std::max(0.0, left(now_s) - 1);
    at_s_ = now_s;
  }

 private:
  double left(double now_s) const { return std::min(in_a_row_, left_ + std::max(0.0, now_s - at_s_) * rate_s_); }
  double in_a_row_, rate_s_, left_, at_s_ = 0;
};

// Tells the new life of a process from a second process of the same name: the old life does not speak again. No
// sockets, no clocks.

class Namesakes {
 public:
  static constexpr double kMemory_s = 10;       ///< who was replaced speaks again within a second, if it lives
  static constexpr size_t kMostKept = 1 << 12;  ///< beyond, the one that was replaced first is forgotten

  /// Another process of its role and name took this one's place.
  void replaced(InstanceId instance, double now_s);
  /// This process says hello. True: it was replaced a moment ago, and yet it lives. Told once for each time.
  bool lives_on(InstanceId instance, double now_s);

 private:
  std::map<InstanceId, double> replaced_;  // when
};

// Processes that left long ago, for the run's record: the newest whole, the others counted.

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

// What a process may say of itself: all of it is remembered, and parts of it are told to everyone.

inline constexpr size_t kMaxNameBytes = 128;
inline constexpr size_t kMaxEndpoints = 16;
inline constexpr size_t kMaxFacts = 64;
inline constexpr size_t kMaxFactsBytes = 512u << 10;  ///< all of them together: a welcome with them is a message
inline constexpr size_t kMaxParameters = 256;

/// Error: which of these is exceeded, a role that is none of "data", "sampler", "packer", "viewer", "ctl", an instance
/// that is 0 or not below 2^53, a name that is missing or has control characters: it is shown and written to files.
Status check_hello(const wire::Hello& hello);

}  // namespace telesplat::master
