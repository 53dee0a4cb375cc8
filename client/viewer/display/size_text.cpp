#include "client/viewer/display/size_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/geometry/camera.h"

namespace telesplat::viewer {

std::optional<std::pair<int, int>> parse_pair(const std::string& text, int least, int most) {
  int a = 0, b = 0;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, a);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, b);
  if (second.ec != std::errc() || second.ptr != end || std::min(a, b) < least || std::max(a, b) > most)
    return std::nullopt;
  return std::pair{a, b};
}

Result<std::pair<int, int>> parse_size(const std::string& text, const char* flag) {
  if (const auto pair = parse_pair(text, 16, geometry::kMaxImageSide)) return *pair;
  return Error{fmt::format("{} {}: not WIDTHxHEIGHT with both in 16..{}", flag, text, geometry::kMaxImageSide)};
}

}  // namespace telesplat::viewer
