// Logging to stderr, one line an event: "time service level text". Only log.cpp sees the library that writes the lines.
#pragma once

#include <fmt/core.h>

#include <string>

namespace telesplat::log {

enum class Level { kDebug, kInfo, kWarn, kError };

/// Names this process in every line. level: trace, debug, info, warn, error, off.
void initialise(const std::string& service, const std::string& level);

/// Writes one line if `level` is switched on; formats it only then. Any thread. Foreign text may be in it: control
/// characters and bytes that are not UTF-8 become U+FFFD, and the line ends after 4096 bytes.
void write(Level level, fmt::string_view format, fmt::format_args arguments);

// Formats are checked against their arguments when the caller is compiled.
template <class... Arguments>
void debug(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kDebug, format, fmt::make_format_args(arguments...));
}
template <class... Arguments>
void info(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kInfo, format, fmt::make_format_args(arguments...));
}
template <class... Arguments>
void warn(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kWarn, format, fmt::make_format_args(arguments...));
}
template <class... Arguments>
void error(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kError, format, fmt::make_format_args(arguments...));
}

/// Lets through at most one line a second for each limiter, and counts those that it held back.
class RateLimiter {
 public:
  /// True if the caller should log now; suppressed() then returns how many calls got false since the last true.
  bool allow(double now_s);
  int suppressed() const { return reported_; }

 private:
  double last_s_ = -1e9;
  int waiting_ = 0, reported_ = 0;
};

}  // namespace telesplat::log
