// Processes of one session on this machine: starts each with its arguments, ends all together.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/net/keys/access.h"
#include "tools/telesplat/run/child_process.h"

namespace telesplat::launcher {

/// Decides how often a process may die before its session gives it up, and how long a restart waits. Takes times, reads
/// no clock.
class Restarts {
 public:
  /// A process that dies more than kMost times in kWithin_s is not started again.
  static constexpr int kMost = 5;
  static constexpr double kWithin_s = 60;
  /// The first restart in that time comes at once, the next after this wait, the one after that after twice this, and
  /// so on.
  static constexpr double kWait_s = 0.25, kLongestWait_s = 4;

  /// Number of restarts in the kWithin_s before now_s.
  int lately(double now_s) {
    while (!deaths_.empty() && deaths_.front() < now_s - kWithin_s) deaths_.pop_front();
    return static_cast<int>(deaths_.size());
  }
  /// Notes a death; returns the time of the restart.
  double died(double now_s) {
    const int before = lately(now_s);
    deaths_.push_back(now_s);
    ++all_;
    if (before == 0) return now_s;
    return now_s + std::min(kWait_s * static_cast<double>(1u << std::min(before - 1, 20)), kLongestWait_s);
  }
  /// Number in the whole session.
  int all() const { return all_; }

 private:
  std::deque<double> deaths_;
  int all_ = 0;
};

/// Returns the folder of the running program: the other programs lie there, too.
std::string program_directory();
/// Returns the output of a program beside it; empty: the program is missing, or prints nothing.
std::string output_of(const std::string& program, const std::string& argument);

/// A service program of this project, and its arguments.
struct Member {
  std::string role;  ///< "master", "data", "packer", "sampler", "viewer": the program is telesplat-ROLE
  std::string name;
  std::vector<std::string> arguments;  ///< beside name, log level and the master's address
  int nice = 0;
  bool joins = true;          ///< gets the master's address
  bool told = false;          ///< reads lines from ChildProcess::tell()
  bool given_up = false;      ///< it has ended without consequence
  std::string record_failed;  ///< its report of a part of the record that it could not write; empty: no failure
  Restarts restarts;
  std::optional<double> again_s;  ///< it has died; time of its restart (monotonic_s())
  std::optional<ChildProcess> process;
};

class ProcessGroup {
 public:
  /// stderr of each process goes to LOG_DIRECTORY/NAME.log; the folder is made when the first process starts.
  ProcessGroup(const std::string& log_directory, const std::string& log_level)
      : log_directory_(log_directory), log_level_(log_level) {}

  /// Passes this folder of keys to all processes started later, and uses them to ask the master. Error: the keys do not
  /// allow that.
  Status use_keys(const std::string& folder);
  /// Keys for asking the master.
  const net::Access& access() const { return access_; }

  /// Starts a master of the group's own and waits until it listens. Error: it ended, printed nothing for `patience_s`,
  /// or Ctrl-C came.
  Status start_master(std::vector<std::string> arguments, double patience_s);
  /// Joins another master's session, instead of start_master().
  void join(const std::string& endpoint) { endpoint_ = endpoint; }
  /// Where the master listens.
  const std::string& endpoint() const { return endpoint_; }

  /// Starts a process, with the master's address if it joins.
  Status start(Member member);
  /// Starts a process that prints the address where it listens, and waits for that line. Returns the address. Error: it
  /// ended, printed nothing for `patience_s`, or Ctrl-C came.
  Result<std::string> start_listener(Member member, double patience_s);
  /// Starts a member that died again.
  Status restart(Member& member);

  /// Ends the members of a role and forgets them; waits for that, some seconds at most.
  void end(const std::string& role);

  /// In the order of their start; pointers stay valid until end() forgets members.
  std::deque<Member>& members() { return members_; }
  Member* find(const std::string& name);

  /// Returns the last line that a process logged, without the program's name.
  std::string last_log_line(const std::string& name) const;
  const std::string& log_directory() const { return log_directory_; }
  /// Keeps every log within kMostLogBytes. Call it now and then; it looks once a second.
  void limit_logs(double now_s);

  /// Ends everything: viewers first, so that their last measurements arrive, then a "stop" to the group's own master,
  /// then all others. A signal to this process shortens all waits.
  void finish();

 private:
  std::string log_directory_, log_level_, endpoint_, keys_;
  net::Access access_;
  std::deque<Member> members_;
  double looked_at_logs_s_ = -1e9;
};

/// A log of this many bytes begins anew. Its former content is kept once, so that a process has at most twice as much,
/// and the bytes it writes between two looks.
inline constexpr uint64_t kMostLogBytes = 64u << 20;

/// NAME.log becomes NAME.before.log, in place of an older one, if it has more than `most` bytes. The process that
/// appends to it goes on with an empty NAME.log; a line that it writes at that moment may be lost. If a full disk
/// prevents the copy, the content is dropped. Links stay as they are.
void limit_log(const std::string& path, uint64_t most = kMostLogBytes);

}  // namespace telesplat::launcher
