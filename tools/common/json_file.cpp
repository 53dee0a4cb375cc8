#include "tools/common/json_file.h"

#include <filesystem>
#include <fstream>

namespace telesplat::tools {

nlohmann::ordered_json read_json_file(const std::string& path) {
  using nlohmann::ordered_json;
  std::error_code error;
  const bool sane = std::filesystem::is_regular_file(path, error) &&
                    std::filesystem::file_size(path, error) <= kMostJsonBytes && !error;
  std::ifstream in(path, std::ios::binary);
  if (!sane || !in) return ordered_json(ordered_json::value_t::discarded);
  const auto shallow = [](int depth, ordered_json::parse_event_t, ordered_json&) { return depth < kDeepestJson; };
  return ordered_json::parse(in, shallow, false);
}

}  // namespace telesplat::tools
