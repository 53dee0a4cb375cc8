// Whether this machine is too busy for a process: how long it waited for a processor, as the kernel counts it.
#pragma once

#include <sys/types.h>

namespace telesplat::launcher {

class ProcessorWait {
 public:
  /// Of its time from which on a person is told.
  static constexpr double kMuch = 0.1;

  /// Now and then, while the process runs. Its main thread counts: a viewer's displays.
  void look(pid_t process, double now_s);
  /// Share of the time from the first look to the last one; 0 where the kernel does not tell.
  double share() const { return last_s_ > first_s_ ? (last_waited_s_ - first_waited_s_) / (last_s_ - first_s_) : 0; }

 private:
  double first_s_ = 0, last_s_ = 0, first_waited_s_ = 0, last_waited_s_ = 0;
};

}  // namespace telesplat::launcher
