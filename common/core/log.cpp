#include "common/core/log.h"

#include <spdlog/sinks/stdout_sinks.h>

namespace telesplat::log {

void initialise(const std::string& service, const std::string& level) {
  auto logger = spdlog::get(service);
  if (!logger) logger = spdlog::stderr_logger_mt(service);
  spdlog::set_default_logger(logger);
  spdlog::set_pattern("%H:%M:%S.%e %n %l %v");
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::flush_on(spdlog::level::warn);
}

bool RateLimiter::allow(double now_s) {
  if (now_s - last_s_ < 1.0) {
    ++waiting_;
    return false;
  }
  last_s_ = now_s;
  reported_ = waiting_;
  waiting_ = 0;
  return true;
}

}  // namespace telesplat::log
