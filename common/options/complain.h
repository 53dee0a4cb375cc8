// Reports errors to a program's user.
#pragma once

#include <cstdio>

#include "common/core/result.h"
#include "common/core/utf8.h"

namespace telesplat {

/// Prints one line on stderr, without characters that steer a terminal. Returns `code`, so that a command can end with
/// it: 2 bad usage or input, 1 failed while running.
inline int complain(const Error& error, int code = 2, const char* program = "telesplat") {
  std::fprintf(stderr, "%s: %s\n", program, printable_lines(error.text).c_str());
  return code;
}

}  // namespace telesplat
