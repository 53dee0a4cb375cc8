// Folders named after the moment in which something was recorded.
#pragma once

#include <ctime>
#include <filesystem>
#include <string>

namespace telesplat::launcher {

/// "runs/PREFIX20260131-142500", by this machine's clock; with "-2", "-3" ... where that is there already.
inline std::string dated_folder(const std::string& prefix = "") {
  char date[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y%m%d-%H%M%S", std::localtime(&now));
  const std::string first = "runs/" + prefix + date;
  std::string folder = first;
  std::error_code error;
  for (int n = 2; std::filesystem::exists(folder, error) && n < 1000; ++n) folder = first + "-" + std::to_string(n);
  return folder;
}

}  // namespace telesplat::launcher
