// Helps the master with processes: checks of a hello, the pace of messages, processes of one name, processes that left.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/metrics/process.h"
#include "common/wire/session_messages.h"
#include "services/master/control.h"

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

/// A process that takes part, or left a moment ago.
struct Peer {
  wire::Hello hello;
  metrics::Process process;
  std::deque<std::map<std::string, double>> reports;  ///< the newest few, for rates
  double seen_s = 0;
  uint64_t joined = 0;  ///< rises with each process that joins or comes back
  bool gone = false;
  bool refused = false;                   ///< true for a data server whose scene cannot be shown
  std::optional<CouplingOrder> coupling;  ///< ordered for this viewer; nullopt: not ordered
  int leases_at_once = 0;                 ///< for samplers: see Idle::Sampler::at_once
  Pace hello_pace{8, 4};               ///< burst for new facts; then the rate of a process that waits for its welcome
  std::optional<wire::Hello> put_off;  ///< newest hello, while hello_pace allows no more
  double probed_s = -1e9;              ///< when an overdue lease last had it probed

  /// It takes part in this role.
  bool serves_as(std::string_view role) const { return !gone && hello.role == role; }
};

/// Processes by their routing ids: those that take part, and those that left within Departed::kAfter_s.
class Peers {
 public:
  using Known = std::map<std::string, Peer>;
  static constexpr size_t kMostGone = 1024;  ///< processes that left and are remembered

  /// Null: no such process is known.
  Peer* find(const std::string& id);
  /// Likewise of the process with this instance, with its routing id.
  Known::value_type* find(InstanceId instance);
  /// True if the process with this instance has this routing id: it may have come back with another one.
  bool speaks_for(const std::string& id, InstanceId instance) const;
  /// Null: it takes no part.
  const Peer* here(const std::string& id) const;
  /// Takes in what a process says of itself.
  Peer& enter(const std::string& id, const wire::Hello& hello, double now_s);
  /// Forgets a process that left if there are too many. False: `most` take part, and this one is another.
  bool make_room(const std::string& id, size_t most);
  void forget_departed(double now_s);

  /// Routing id of the packer that has been here for longest: others wait for it to leave; empty: no packer is here.
  std::string packer() const;
  /// True: another packer leads from now on.
  bool follow_packer();
  bool leads_packer() const { return !leading_packer_.empty(); }
  /// It is gone, or another process is at its connection.
  void leave_packer(const std::string& id) {
    if (id == leading_packer_) leading_packer_.clear();
  }
  bool has(std::string_view role) const {
    return std::any_of(begin(), end(), [&](const auto& p) { return p.second.serves_as(role); });
  }
  /// Returns the roles that the session needs and no process has, such as "data,sampler".
  std::string lacks() const;
  /// Returns all processes, also those that left, in order of their names. For the run's record.
  std::vector<metrics::Process> processes() const;
  const Departed& departed() const { return departed_; }
  Namesakes& namesakes() { return namesakes_; }

  size_t size() const { return known_.size(); }
  Known::iterator begin() { return known_.begin(); }
  Known::iterator end() { return known_.end(); }
  Known::const_iterator begin() const { return known_.begin(); }
  Known::const_iterator end() const { return known_.end(); }

 private:
  void forget(const Peer& peer, const std::string& id);

  Known known_;
  std::unordered_map<InstanceId, std::string> instances_;  // routing ids, by instance
  Namesakes namesakes_;
  Departed departed_;
  uint64_t joined_ = 0;
  std::string leading_packer_;  // packer of the frames; empty: no packer yet, or it is gone
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
