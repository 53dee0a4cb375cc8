#include "tools/telesplat/scene/toml_file.h"

#include <fmt/format.h>

#include "common/core/whole_file.h"

namespace telesplat::launcher {

Result<toml::table> read_toml(const std::string& path, uint64_t most_bytes) {
  const auto text = read_whole(path, most_bytes);
  if (!text) return text.error();
  try {
    return toml::parse(*text, path);
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
}

}  // namespace telesplat::launcher
