// Threads, where an exception that nobody catches would end the process.
#pragma once

#include <exception>
#include <string>
#include <string_view>
#include <utility>

#include "common/core/log.h"
#include "common/core/result.h"

namespace telesplat {

/// What the exception says that is being handled.
std::string current_problem() noexcept;

/// Does `work`. An exception that leaves it is logged, "NAME failed: why", and is the error: whoever owns the thread
/// counts what is lost by it. Not for main(), which ends with one line and exit code 1 (net::guarded_main).
template <class Work>
Status guarded(std::string_view name, Work&& work) {
  try {
    std::forward<Work>(work)();
    return ok_status();
  } catch (...) {
    const std::string why = current_problem();
    log::error("{} failed: {}", name, why);
    return Error{why};
  }
}

}  // namespace telesplat
