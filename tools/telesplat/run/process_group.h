// Processes of one session on this machine: started with what each must be told, ended together.
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

/// How often a process may die before its session gives it up, and how long it waits before it is started again. Times
/// come in.
class Restarts {
 public:
  /// A process that dies more often than this in this time is not started again.
  static constexpr int kMost = 5;
  static constexpr double kWithin_s = 60;
  /// The first in that time is followed at once, the next after this time, the one after that after twice this time,
  /// and so on.
  static constexpr double kWait_s = 0.25, kLongestWait_s = 4;

  /// How often it was started again in the time before now_s.
  int lately(double now_s) {
    while (!deaths_.empty() && deaths_.front() < now_s - kWithin_s) deaths_.pop_front();
    return static_cast<int>(deaths_.size());
  }
  /// It died, and is to be started again. Returns when.
  double died(double now_s) {
    const int before = lately(now_s);
    deaths_.push_back(now_s);
    ++all_;
    if (before == 0) return now_s;
    return now_s + std::min(kWait_s * static_cast<double>(1u << std::min(before - 1, 20)), kLongestWait_s);
  }
  /// In the whole session.
  int all() const { return all_; }

 private:
  std::deque<double> deaths_;
  int all_ = 0;
};

/// Folder of the program that runs: the others lie beside it.
std::string program_directory();
/// What a program beside it prints; empty: it is not there, or prints nothing.
std::string output_of(const std::string& program, const std::string& argument);

/// A service program of this project, and how it is started.
struct Member {
  std::string role;  ///< "master", "data", "packer", "sampler", "viewer": the program is telesplat-ROLE
  std::string name;
  std::vector<std::string> arguments;  ///< beside name, log level and the master's address
  int nice = 0;
  bool joins = true;          ///< is told where the master is
  bool told = false;          ///< ChildProcess::tell() reaches it
  bool given_up = false;      ///< it has ended, and nothing follows from that
  std::string record_failed;  ///< what it could not write of the record, as it said; empty: nothing
  Restarts restarts;
  std::optional<double> again_s;  ///< it has died, and is to be started again then (monotonic_s())
  std::optional<ChildProcess> process;
};

class ProcessGroup {
 public:
  /// stderr of each process goes to LOG_DIRECTORY/NAME.log; the folder is made when the first process starts.
  ProcessGroup(const std::string& log_directory, const std::string& log_level)
      : log_directory_(log_directory), log_level_(log_level) {}

  /// Those that are started from now on are told of this folder of keys, and a master is asked with them. Error: they
  /// are not good for that.
  Status use_keys(const std::string& folder);
  /// By which a master is asked.
  const net::Access& access() const { return access_; }

  /// Starts a master of the group's own and waits until it listens. Error: it ended, said nothing for `patience_s`, or
  /// Ctrl-C came.
  Status start_master(std::vector<std::string> arguments, double patience_s);
  /// Instead of start_master(): the session of another master.
  void join(const std::string& endpoint) { endpoint_ = endpoint; }
  /// Where the master listens.
  const std::string& endpoint() const { return endpoint_; }

  /// Starts a process that is told where the master is, if it joins.
  Status start(Member member);
  /// Starts a process that listens somewhere, and says so in a line, and waits for that. Returns where. Error: it
  /// ended, said nothing for `patience_s`, or Ctrl-C came.
  Result<std::string> start_listener(Member member, double patience_s);
  /// Starts a member that died once more.
  Status restart(Member& member);

  /// Ends the members of a role, which are forgotten; waits for that, some seconds at most.
  void end(const std::string& role);

  /// In the order of their start; addresses hold until some are forgotten.
  std::deque<Member>& members() { return members_; }
  Member* find(const std::string& name);

  /// The last line that a process logged, without the program's name.
  std::string last_log_line(const std::string& name) const;
  const std::string& log_directory() const { return log_directory_; }
  /// No log stays larger than kMostLogBytes. To be called now and then; looks once a second.
  void limit_logs(double now_s);

  /// Ends everything: viewers first, so that their last measurements arrive, then a "stop" to the group's own master,
  /// then all others. If this process is told to stop meanwhile, at once.
  void finish();

 private:
  std::string log_directory_, log_level_, endpoint_, keys_;
  net::Access access_;
  std::deque<Member> members_;
  double looked_at_logs_s_ = -1e9;
};

/// Bytes after which a log begins anew. What was before is kept once, so that a process has twice as much at most, and
/// what it writes between two looks.
inline constexpr uint64_t kMostLogBytes = 64u << 20;

/// NAME.log becomes NAME.before.log, in place of an older one, if it has more than `most` bytes. The process that
/// appends to it goes on with an empty NAME.log; a line that it writes at that moment may be lost. What cannot be
/// copied, since the disk is full, is dropped. Links stay as they are.
void limit_log(const std::string& path, uint64_t most = kMostLogBytes);

}  // namespace telesplat::launcher
