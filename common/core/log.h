// Logging to stderr, one line an event: "time service level text". Thin over spdlog so that formats stand in one place.
#pragma once

#include <spdlog/spdlog.h>

#include <string>

namespace telesplat::log {

using spdlog::debug;
using spdlog::error;
using spdlog::info;
using spdlog::warn;

/// Names this process in every line. level: trace, debug, info, warn, error, off.
void initialise(const std::string& service, const std::string& level);

/// At most one line a second for each limiter; says how many were left out.
class RateLimiter {
 public:
  /// Returns true if the caller should log now; suppressed() then tells how many calls said no since the last yes.
  bool allow(double now_s);
  int suppressed() const { return reported_; }

 private:
  double last_s_ = -1e9;
  int waiting_ = 0, reported_ = 0;
};

}  // namespace telesplat::log
