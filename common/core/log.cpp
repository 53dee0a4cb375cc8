#include "common/core/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <string_view>

#include "common/core/utf8.h"

namespace telesplat::log {
namespace {

constexpr size_t kMostOfLine = 4096;

spdlog::level::level_enum library_level(Level level) {
  constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info, spdlog::level::warn,
                                                   spdlog::level::err};
  return kLevels[static_cast<int>(level)];
}

}  // namespace

void initialise(const std::string& service, const std::string& level) {
  auto logger = spdlog::get(service);
  if (!logger) logger = spdlog::stderr_logger_mt(service);
  spdlog::set_default_logger(logger);
  spdlog::set_pattern("%H:%M:%S.%e %n %l %v");
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::flush_on(spdlog::level::warn);
}

void write(Level level, fmt::string_view format, fmt::format_args arguments) {
  spdlog::logger* logger = spdlog::default_logger_raw();
  if (!logger->should_log(library_level(level))) return;
  const std::string line = printable(fmt::vformat(format, arguments), kMostOfLine);
  logger->log(library_level(level), std::string_view(line));
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
