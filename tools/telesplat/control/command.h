// `telesplat ctl COMMAND ...`: asks or tells a running session's master.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace telesplat::launcher {

struct ControlOptions {
  std::string command, master = "tcp://127.0.0.1:7700";
  std::vector<std::string> arguments;
};

void add_control_flags(CLI::App& app, ControlOptions& options);

/// Prints the answer. Exit code: 0 done, 1 the master refuses or does not answer, 2 bad usage.
int control(const ControlOptions& options);

}  // namespace telesplat::launcher
