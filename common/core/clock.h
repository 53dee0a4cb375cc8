// Time. Cores of services take times as arguments; only main loops read clocks.
#pragma once

#include <string>

namespace telesplat {

/// Seconds since an arbitrary, machine-wide origin (CLOCK_MONOTONIC: the same for all processes of one machine).
double monotonic_s();

/// Names the clock that monotonic_s() reads: processes of one machine, in one time namespace, have the same id. Empty:
/// the system does not report it.
const std::string& clock_id();

/// Seconds since 1970 (UTC), by the system's clock, which people and NTP set.
double wall_clock_s();

/// Returns at once if monotonic_s() is t_s or later.
void sleep_until(double t_s);

/// CPU seconds used by the calling thread.
double thread_cpu_s();

}  // namespace telesplat
