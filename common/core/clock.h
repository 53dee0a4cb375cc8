// Time. Cores of services take times as arguments; only main loops read clocks.
#pragma once

namespace telesplat {

/// Seconds since an arbitrary, machine-wide origin (CLOCK_MONOTONIC: the same for all processes of one machine).
double monotonic_s();

/// CPU seconds used by the calling thread.
double thread_cpu_s();

}  // namespace telesplat
