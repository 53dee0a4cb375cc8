// The machine that a process runs on and the command line that started it, for records of what was done.
#pragma once

#include <cstdint>
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

// What a process asks of the machine: time, chance, its number, and whether it was told to stop. A simulation of whole
// sessions in one process (tools/lab/simulation) puts another in its place.

class World {
 public:
  virtual ~World() = default;
  virtual double monotonic_s() = 0;           ///< of the process whose turn it is
  virtual double thread_cpu_s() = 0;          ///< likewise
  virtual const std::string& clock_id() = 0;  ///< likewise
  virtual uint64_t random_bits() = 0;         ///< 64 of them
  virtual uint64_t process_id() = 0;
  virtual bool stop_requested() = 0;
};

/// From now on this process asks `world`, which must outlive that; null: the system. No other thread may ask meanwhile.
void enter_world(World* world);
/// Null: the system.
World* simulated_world();

/// 64 random bits, of the system's source, or of the simulated world's.
uint64_t random_bits();
/// The process' number.
uint64_t process_id();

}  // namespace telesplat
