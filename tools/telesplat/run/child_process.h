// Child processes of the launcher: started, watched, always ended.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "common/core/descriptor.h"
#include "common/core/result.h"

namespace telesplat::launcher {

class ChildProcess {
 public:
  /// Starts `program` (a path). stderr goes to `log_path` (appended); stdout lines come back through read_lines(). The
  /// child has a process group of its own, so that Ctrl-C reaches the launcher alone; if the launcher dies, the kernel
  /// ends the child. told: its standard input is a pipe from tell().
  static Result<ChildProcess> start(const std::string& name, const std::string& program,
                                    const std::vector<std::string>& arguments, const std::string& log_path, int nice,
                                    bool told = false);
  ~ChildProcess();  ///< kills the child if it still runs
  ChildProcess(ChildProcess&&) noexcept;
  ChildProcess& operator=(ChildProcess&&) noexcept;

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  /// Complete lines written to stdout since the last call; does not wait.
  std::vector<std::string> read_lines();
  /// Sends it a line; does not wait: a line that finds no room is lost.
  void tell(const std::string& line);
  /// True if it has ended; does not wait.
  bool ended();
  /// Exit code, or 128 + signal. Precondition: ended().
  int exit_code() const { return *exit_code_; }
  void signal(int number);
  /// Waits for it to end by itself, then sends SIGTERM, then SIGKILL, each after `patience_s` more; does not wait if
  /// this process has a signal to stop.
  void finish(double patience_s);

 private:
  ChildProcess() = default;
  std::string name_;
  pid_t pid_ = -1;
  Descriptor stdout_, stdin_;
  std::string partial_line_;
  std::optional<int> exit_code_;
};

}  // namespace telesplat::launcher
