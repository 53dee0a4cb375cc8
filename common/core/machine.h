// The machine that a process runs on, and the command line that started it, for records.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace telesplat {

struct Machine {
  std::string processor;  ///< model; empty: the system does not report it
  int cores = 0;          ///< usable_processors()
  double memory_mb = 0;   ///< 0: the system does not report it
};
Machine this_machine();

/// Number of processors that this process may use, at least 1: those that it may run on (taskset, cpusets), but at most
/// its control group's share of time (cpu.max, as of containers with --cpus). std::thread ignores that share.
int usable_processors();

/// Memory that this process may use, MB: the machine's, but at most its control group's (memory.max, as of containers
/// with --memory); 0: the system does not report it.
double usable_memory_mb();

/// Writes arguments as a shell would take them, with quotes where needed.
std::string shell_line(const std::vector<std::string>& arguments);
/// This process' own command line. Beyond 8192 bytes it is cut, with "..." at its end.
std::string command_line();

/// Variable in which a launcher passes its own command line to the processes that it starts.
inline constexpr const char* kLaunchedByVariable = "TELESPLAT_LAUNCHED_BY";

// A process asks its World for the time, random bits, its process number, and whether to stop. A simulation of whole
// sessions in one process (tools/lab/simulation) puts another World in its place.

class World {
 public:
  virtual ~World() = default;
  virtual double monotonic_s() = 0;           ///< clock of the simulated process that runs now
  virtual double thread_cpu_s() = 0;          ///< likewise its CPU time
  virtual const std::string& clock_id() = 0;  ///< likewise its clock's id
  virtual uint64_t random_bits() = 0;         ///< 64 random bits
  virtual uint64_t process_id() = 0;
  virtual bool stop_requested() = 0;
};

/// From now on this process asks `world`, which must outlive that; null: the system. No other thread may ask meanwhile.
void enter_world(World* world);
/// The world of enter_world(); null: the system.
World* simulated_world();

/// 64 random bits, from the system's source or from the simulated world.
uint64_t random_bits();
/// The process' number.
uint64_t process_id();

}  // namespace telesplat
