// Catches exceptions at the border of a thread, where an uncaught one would end the process.
#pragma once

#include <exception>
#include <string>
#include <string_view>
#include <utility>

#include "common/core/log.h"
#include "common/core/result.h"

namespace telesplat {

/// Text of the exception that is being handled.
std::string current_problem() noexcept;

/// Does `work`. An exception that leaves it is logged, "NAME failed: why", and becomes the error: the owner of the
/// thread counts its losses. Not for main(), which ends with one line and exit code 1 (net::guarded_main).
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
