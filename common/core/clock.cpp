#include "common/core/clock.h"

#include <chrono>
#include <ctime>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/core/machine.h"

namespace telesplat {
namespace {

double read_s(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::string text_of(const char* path) {
  std::ostringstream out;
  out << std::ifstream(path).rdbuf();
  return out.str();
}

// The id of this start of the system, and the offset of this process' clock against the system's.
std::string read_clock_id() {
  std::istringstream boot(text_of("/proc/sys/kernel/random/boot_id"));
  std::string id;
  if (!(boot >> id)) return {};
  std::istringstream offsets(text_of("/proc/self/timens_offsets"));
  for (std::string clock, s, ns; offsets >> clock >> s >> ns;)
    if (clock == "monotonic") return id + "+" + s + "." + ns;
  return id + "+0.0";  // a kernel without time namespaces
}

}  // namespace

const std::string& clock_id() {
  if (World* world = simulated_world()) return world->clock_id();
  static const std::string id = read_clock_id();
  return id;
}
double monotonic_s() {
  World* world = simulated_world();
  return world ? world->monotonic_s() : read_s(CLOCK_MONOTONIC);
}
double wall_clock_s() {
  constexpr double kSimulatedBegin_s = 1.7e9;
  if (World* world = simulated_world()) return kSimulatedBegin_s + world->monotonic_s();
  return read_s(CLOCK_REALTIME);
}
void sleep_until(double t_s) {
  const double wait_s = t_s - monotonic_s();
  if (wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
}
double thread_cpu_s() {
  World* world = simulated_world();
  return world ? world->thread_cpu_s() : read_s(CLOCK_THREAD_CPUTIME_ID);
}

}  // namespace telesplat
