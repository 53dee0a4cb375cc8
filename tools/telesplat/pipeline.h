// The processes of one session on this machine: started in any order, supervised, ended together.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "tools/telesplat/child_process.h"
#include "tools/telesplat/run_command.h"

namespace telesplat::launcher {

class Pipeline {
 public:
  /// Starts master, data, packer, samplers and a viewer (the viewer alone if options.join_master is set).
  static Result<Pipeline> start(const RunOptions& options);

  const std::string& master_endpoint() const { return master_endpoint_; }

  enum class State { kRunning, kFinished, kFailed, kBadInput };
  /// Looks after the children; does not wait. Samplers, packer and data that die are restarted (5 times each at most); the
  /// master's or the viewer's death ends the run. `news` gets lines for the person.
  State supervise(std::vector<std::string>& news);
  /// "reading 43 %" and the like, from the children's progress lines; empty if there is nothing to tell.
  std::string progress();
  /// Lines that the viewer told the person, since the last call.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }
  /// Ends everything: the viewer first, then a "stop" to the master, then whoever is left.
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
  Status launch(Member& member);
  void read(Member& member);
  std::string last_log_line(const std::string& name) const;

  std::string log_directory_, master_endpoint_, progress_;
  std::vector<std::string> notes_;
  std::vector<Member> members_;
  int restarts_ = 0;
};

/// Folder of the program that runs: the others lie beside it.
std::string program_directory();

}  // namespace telesplat::launcher
