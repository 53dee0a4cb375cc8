// Folders named after the moment in which something was recorded.
#pragma once

#include <ctime>
#include <string>

namespace telesplat::launcher {

/// "runs/PREFIX20260131-142500", by this machine's clock.
inline std::string dated_folder(const std::string& prefix = "") {
  char date[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y%m%d-%H%M%S", std::localtime(&now));
  return "runs/" + prefix + date;
}

}  // namespace telesplat::launcher
