#include "client/displays/window/new_file.h"

#include <fmt/format.h>

#include <ctime>
#include <filesystem>

namespace telesplat::viewer {

std::string new_file(const std::string& folder, const std::string& what, const std::string& ending) {
  char date[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y%m%d-%H%M%S", std::localtime(&now));
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string name = fmt::format("{}/{}-{}", folder, what, date);
  std::string out = name + ending;
  for (int n = 2; std::filesystem::exists(out, error); ++n) out = fmt::format("{}-{}{}", name, n, ending);
  return out;
}

}  // namespace telesplat::viewer
