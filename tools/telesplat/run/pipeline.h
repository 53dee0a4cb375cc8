// The processes of one session on this machine: started in any order, supervised, ended together.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tools/telesplat/control/client.h"
#include "tools/telesplat/run/child_process.h"
#include "tools/telesplat/run/run_command.h"

namespace telesplat::launcher {

class Pipeline {
 public:
  /// Starts master, data servers, packer, samplers and viewers (the viewers alone if options.join_master is set). Those of a wall follow in
  /// supervise(), once the data servers have read their data.
  static Result<Pipeline> start(const RunOptions& options);

  const std::string& master_endpoint() const { return master_endpoint_; }

  enum class State { kRunning, kFinished, kFailed, kBadInput };
  /// Looks after the children; does not wait. Samplers, packer and data that die are restarted (5 times each at most); the
  /// master's or a viewer's death ends the run, which is finished when all viewers are. `news` gets lines for the person.
  State supervise(std::vector<std::string>& news);
  /// "reading 43 %" and the like, from the children's progress lines; empty if there is nothing to tell.
  std::string progress();
  /// Lines that viewers told the person, since the last call.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }
  /// Ends everything: viewers first, then a "stop" to the master, then whoever is left.
  void finish();
  int restarts() const { return restarts_; }

 private:
  struct Member {
    std::string role, program;
    std::vector<std::string> arguments;
    int nice = 0;
    int restarts = 0;
    std::optional<ChildProcess> process;
  };
  void add_viewers(double clock_from_s);
  Status start_wall();
  Status launch(Member& member);
  void read(Member& member);
  std::string last_log_line(const std::string& name) const;

  std::string log_directory_, master_endpoint_, progress_;
  std::vector<std::string> notes_;
  std::vector<Member> members_;
  int restarts_ = 0;
  std::unique_ptr<RunOptions> options_;
  bool has_viewers_ = false;
  std::unique_ptr<ControlClient> control_;  // while a wall's viewers wait
  double asked_s_ = -1e9;
};

/// Folder of the program that runs: the others lie beside it.
std::string program_directory();

}  // namespace telesplat::launcher
