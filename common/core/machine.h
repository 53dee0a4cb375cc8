// The machine that a process runs on and the command line that started it, for records of what was done.
#pragma once

#include <string>
#include <vector>

namespace telesplat {

struct Machine {
  std::string processor;  ///< model; empty: the system does not tell
  int cores = 0;          ///< usable_processors()
  double memory_mb = 0;   ///< 0: the system does not tell
};
Machine this_machine();

/// How many processors this process may use, at least 1: those that it may run on (taskset, cpusets), and no more than
/// its control group's share of time comes to (cpu.max, as of containers with --cpus). std::thread does not count so.
int usable_processors();

/// Arguments as a shell would take them: what needs quotes has some.
std::string shell_line(const std::vector<std::string>& arguments);
/// This process's own. What is longer than 8192 bytes is cut, with "..." at its end.
std::string command_line();

/// Variable by which a launcher tells the processes that it starts its own command line.
inline constexpr const char* kLaunchedByVariable = "TELESPLAT_LAUNCHED_BY";

}  // namespace telesplat
