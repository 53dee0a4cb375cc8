#include "tools/common/json_file.h"

#include <fmt/format.h>

#include "common/core/whole_file.h"

namespace telesplat::tools {
namespace {

using nlohmann::ordered_json;

ordered_json parse(const std::string& text) {
  const auto shallow = [](int depth, ordered_json::parse_event_t, ordered_json&) { return depth < kDeepestJson; };
  return ordered_json::parse(text, shallow, false);
}

}  // namespace

Result<ordered_json> read_json_object(const std::string& path) {
  const auto text = read_whole(path, kMostJsonBytes);
  if (!text) return text.error();
  auto out = parse(*text);
  if (!out.is_object()) return Error{fmt::format("{}: is no JSON object", path)};
  return out;
}

ordered_json read_json_file(const std::string& path) {
  const auto text = read_whole(path, kMostJsonBytes);
  return text ? parse(*text) : ordered_json(ordered_json::value_t::discarded);
}

}  // namespace telesplat::tools
