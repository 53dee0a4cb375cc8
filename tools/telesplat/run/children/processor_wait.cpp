#include "tools/telesplat/run/children/processor_wait.h"

#include <fmt/format.h>

#include <fstream>

namespace telesplat::launcher {

void ProcessorWait::look(pid_t process, double now_s) {
  double ran_ns = 0, waited_ns = 0;
  if (!(std::ifstream(fmt::format("/proc/{}/schedstat", process)) >> ran_ns >> waited_ns)) return;
  last_s_ = now_s, last_waited_s_ = waited_ns * 1e-9;
  if (first_s_ == 0) first_s_ = last_s_, first_waited_s_ = last_waited_s_;
}

}  // namespace telesplat::launcher
