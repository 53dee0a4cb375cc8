#include "tools/telesplat/run/children/log_limit.h"

#include <filesystem>

namespace telesplat::launcher {

void limit_log(const std::string& path, uint64_t most) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::regular) return;
  if (const auto bytes = fs::file_size(path, error); error || bytes <= most) return;
  const std::string before = fs::path(path).replace_extension(".before.log").string();
  fs::remove(before, error);  // a link, not what it leads to
  if (!fs::copy_file(path, before, error)) fs::remove(before, error);
  fs::resize_file(path, 0, error);
}

}  // namespace telesplat::launcher
