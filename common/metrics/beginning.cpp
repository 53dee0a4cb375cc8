#include "common/metrics/beginning.h"

#include <fmt/format.h>

#include <cstdlib>
#include <ctime>

#include "common/core/clock.h"

namespace telesplat::metrics {

Beginning begin_now() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return {monotonic_s(), int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec};
}

std::string iso_time(int64_t unix_ns) {
  constexpr int64_t kSecond_ns = 1'000'000'000;
  const std::time_t seconds = unix_ns / kSecond_ns;
  std::tm local{};
  localtime_r(&seconds, &local);
  char date[32];
  std::strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &local);
  const long minutes = local.tm_gmtoff / 60;
  return fmt::format("{}.{:09}{}{:02}:{:02}", date, unix_ns % kSecond_ns, minutes < 0 ? '-' : '+',
                     std::labs(minutes) / 60, std::labs(minutes) % 60);
}

}  // namespace telesplat::metrics
