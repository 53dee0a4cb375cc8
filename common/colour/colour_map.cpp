#include "common/colour/colour_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "common/colour/paraview_json.h"

namespace telesplat::colour {
namespace {

// Takes a number off the front of `text`.
template <class T, class... Base>
std::optional<T> take_number(std::string_view& text, Base... base) {
  T value{};
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value, base...);
  if (read.ec != std::errc{}) return std::nullopt;
  text.remove_prefix(size_t(read.ptr - text.data()));
  return value;
}

bool take(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

std::optional<uint32_t> take_colour(std::string_view& text) {
  if (!take(text, "#") || text.size() < 6) return std::nullopt;
  std::string_view digits = text.substr(0, 6);
  text.remove_prefix(6);
  const auto rgb = take_number<uint32_t>(digits, 16);
  return digits.empty() ? rgb : std::nullopt;
}

bool read_stops(std::string_view text, ColourMap& map) {
  do {
    const auto x = take_number<double>(text);
    if (!x || !take(text, ":")) return false;
    const auto rgb = take_colour(text);
    if (!rgb || map.stops.size() > kMaxStops) return false;
    map.stops.push_back({*x, *rgb});
  } while (take(text, ","));
  if (text.empty()) return true;
  const auto missing = take(text, "/") ? take_colour(text) : std::nullopt;
  if (missing) map.missing = *missing;
  return missing && text.empty();
}

}  // namespace

uint32_t ColourMap::at(double x) const {
  if (std::isnan(x)) return missing;
  const auto above = std::upper_bound(stops.begin(), stops.end(), x, [](double v, const Stop& s) { return v < s.x; });
  if (above == stops.begin()) return stops.front().rgb;
  if (above == stops.end()) return stops.back().rgb;
  const Stop &a = *std::prev(above), &b = *above;
  const double t = (x - a.x) / (b.x - a.x);
  uint32_t rgb = 0;
  for (int shift = 16; shift >= 0; shift -= 8) {
    const double from = a.rgb >> shift & 255, to = b.rgb >> shift & 255;
    rgb = rgb << 8 | uint32_t(from + (to - from) * t + 0.5);
  }
  return rgb;
}

Result<ColourMap> resolve_colour_map(std::string_view text) {
  const size_t end = text.find(".json");
  if (end == text.npos) return find_colour_map(text);
  const std::string_view behind = text.substr(end + 5);
  if (!behind.empty() && behind[0] != ':')
    return Error{fmt::format("colour map \"{}\": behind .json stands :NAME, or nothing", text.substr(0, 200))};
  const std::string path(text.substr(0, end + 5));
  const auto content = read_map_file(path);
  if (!content) return content.error();
  return parse_colour_map(*content, path, behind.empty() ? behind : behind.substr(1));
}

std::string to_text(const ColourMap& map) {
  if (const auto known = find_colour_map(map.name); known && *known == map) return map.name;
  std::string out = map.name;
  for (const auto& stop : map.stops)
    out += fmt::format("{}{}:#{:06x}", &stop == map.stops.data() ? '=' : ',', stop.x, stop.rgb);
  if (map.missing != ColourMap{}.missing) out += fmt::format("/#{:06x}", map.missing);
  return out;
}

Result<ColourMap> from_text(std::string_view text) {
  if (text.size() > kMaxMapText)
    return Error{fmt::format("colour map: a text of {} bytes, limit {}", text.size(), kMaxMapText)};
  const size_t equals = text.rfind('=');
  if (equals == text.npos) return find_colour_map(text);
  ColourMap map;
  map.name = text.substr(0, equals);
  if (!read_stops(text.substr(equals + 1), map))
    return Error{fmt::format("colour map: \"{}\" is not NAME=0:#rrggbb,1:#rrggbb", text.substr(0, 80))};
  if (const Status valid = validate(map); !valid) return valid.error();
  return map;
}

Status validate(const ColourMap& map) {
  if (map.name.size() > kMaxMapName)
    return Error{fmt::format("colour map: a name of {} bytes, limit {}", map.name.size(), kMaxMapName)};
  if (std::any_of(map.name.begin(), map.name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    return Error{"colour map: the name has control characters"};
  if (map.stops.empty() || map.stops.size() > kMaxStops)
    return Error{fmt::format("colour map {}: {} stops, limits are 1..{}", map.name, map.stops.size(), kMaxStops)};
  double before = 0;
  for (const auto& stop : map.stops) {
    if (!(stop.x >= before && stop.x <= 1))
      return Error{
          fmt::format("colour map {}: a stop at {} after {}; stops ascend from 0 to 1", map.name, stop.x, before)};
    if (stop.rgb > 0xffffff) return Error{fmt::format("colour map {}: a colour of {:#x}", map.name, stop.rgb)};
    before = stop.x;
  }
  if (map.missing > 0xffffff) return Error{fmt::format("colour map {}: a colour of {:#x}", map.name, map.missing)};
  return ok_status();
}

}  // namespace telesplat::colour
