// Processes of one session on this machine: started with what each must be told, ended together.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/net/keys/access.h"
#include "tools/telesplat/run/child_process.h"
#include "tools/telesplat/run/children/restarts.h"

namespace telesplat::launcher {

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

}  // namespace telesplat::launcher
