// The moment from which a run's times count.
#pragma once

#include <cstdint>
#include <string>

namespace telesplat::metrics {

/// One moment on two clocks.
struct Beginning {
  double monotonic_s = 0;  ///< telesplat::monotonic_s() of the master's machine
  int64_t unix_ns = 0;     ///< nanoseconds since 1970 began, UTC; 0: not known
};
Beginning begin_now();

/// "2026-01-31T14:25:00.123456789+01:00", in this machine's time zone.
std::string iso_time(int64_t unix_ns);

}  // namespace telesplat::metrics
