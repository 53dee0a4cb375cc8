// A program that is fed through its input: an encoder.
#pragma once

#include <sys/types.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Whether the person wants an end to it.
using ShouldStop = std::function<bool()>;

class PipedProcess {
 public:
  /// Starts `program` (a path); no shell sees the arguments. It is in a process group of its own, so that Ctrl-C
  /// reaches this program alone, and is killed should this program die. What it says goes into memory.
  /// directory: its working folder; null: this program's.
  static Result<PipedProcess> start(const std::string& program, const std::vector<std::string>& arguments,
                                    const char* directory = nullptr);
  /// Kills it if it still runs.
  ~PipedProcess();
  PipedProcess(PipedProcess&& other) noexcept;
  PipedProcess& operator=(PipedProcess&& other) noexcept;

  /// Feeds it. False: it takes no more, because it has ended, or should_stop said so.
  bool write(std::span<const std::byte> bytes, const ShouldStop& should_stop);
  /// Ends its input and waits for it. Exit code, 128 + signal, or -1 if should_stop said so (it runs on then).
  int finish(const ShouldStop& should_stop);

  /// What it wrote to its output, and the last line that it wrote to its error output; at most 64 KiB are looked at.
  std::string output() const;
  std::string last_error_line() const;

 private:
  PipedProcess() = default;
  void close_input();

  pid_t pid_ = -1;
  int input_ = -1, output_ = -1, errors_ = -1;
};

}  // namespace telesplat::launcher
