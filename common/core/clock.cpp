#include "common/core/clock.h"

#include <ctime>

namespace telesplat {
namespace {

double read_s(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

double monotonic_s() { return read_s(CLOCK_MONOTONIC); }
double thread_cpu_s() { return read_s(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace telesplat
