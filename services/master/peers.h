// Helps the master with processes: checks of a hello, the pace of messages, processes of one name, processes that left.
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

// Limits how often something is done: in_a_row times at once, then rate_s times a second. No clocks.

class Pace {
 public:
  Pace(double in_a_row, double rate_s) : in_a_row_(in_a_row), rate_s_(rate_s), left_(in_a_row) {}

  bool allows(double now_s) const { return left(now_s) >= 1; }
  /// Counts one that is done, allowed or not.
  void count(double now_s) {
    left_ = std::max(0.0, left(now_s) - 1);
    at_s_ = now_s;
  }

 private:
  double left(double now_s) const { return std::min(in_a_row_, left_ + std::max(0.0, now_s - at_s_) * rate_s_); }
  double in_a_row_, rate_s_, left_, at_s_ = 0;
};

// Distinguishes a restarted process from a second process of the same name: after a restart the old one does not speak
// again. No sockets, no clocks.

class Namesakes {
 public:
  static constexpr double kMemory_s = 10;       ///< a replaced process that lives speaks again within a second
  static constexpr size_t kMostKept = 1 << 12;  ///< one more pushes out the one that was replaced first

  /// Another process of its role and name took this one's place.
  void replaced(InstanceId instance, double now_s);
  /// To be called for each hello. True: the process was replaced within kMemory_s, yet it lives; once per replacement.
  bool lives_on(InstanceId instance, double now_s);

 private:
  std::map<InstanceId, double> replaced_;  // time of the replacement, s
};

// Processes that left long ago, for the run's record: keeps the newest and counts the others.

class Departed {
 public:
  static constexpr double kAfter_s = 60;  ///< until then a process that left is listed with the others
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

// Limits of a hello: the master remembers all of it and sends parts of it to everyone.

inline constexpr size_t kMaxNameBytes = 128;
inline constexpr size_t kMaxEndpoints = 16;
inline constexpr size_t kMaxFacts = 64;
inline constexpr size_t kMaxFactsBytes = 512u << 10;  ///< all facts together: they must fit into a welcome
inline constexpr size_t kMaxParameters = 256;

/// Error: one of these is exceeded; the role is not "data", "sampler", "packer", "viewer" or "ctl"; the instance is 0
/// or not below 2^53; the name, which is shown and written to files, is missing or has control characters.
Status check_hello(const wire::Hello& hello);

}  // namespace telesplat::master
