#include "common/scene/colouring.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "common/core/utf8.h"

namespace telesplat::scene {
namespace {

using Json = nlohmann::ordered_json;

// Reads the whole of `text` as a number.
std::optional<double> number(std::string_view text) {
  double value = 0;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  if (parsed.ec == std::errc::invalid_argument || parsed.ptr != text.data() + text.size()) return std::nullopt;
  return parsed.ec == std::errc() ? value : HUGE_VAL;
}

bool fits(double value) { return std::isfinite(value) && std::abs(value) <= kMaxScalar; }

Result<std::string> read_text(const Json& json, const char* key, size_t most) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string() || found->get_ref<const std::string&>().size() > most ||
      !valid_utf8(found->get_ref<const std::string&>()))
    return Error{fmt::format("a colouring's \"{}\" is no UTF-8 text of at most {} bytes", key, most)};
  return found->get<std::string>();
}

Result<double> read_number(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number() || !fits(found->get<double>()))
    return Error{fmt::format("a colouring's \"{}\" is no number within +-{:g}", key, kMaxScalar)};
  return found->get<double>();
}

}  // namespace

std::string to_text(const Colouring& c) {
  const Json json{{"array", c.array}, {"unit", c.unit},     {"lo", c.lo},
                  {"hi", c.hi},       {"origin", c.origin}, {"map", colour::to_text(c.map)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Colouring> colouring_from_text(std::string_view text) {
  if (text.size() > kMaxColouringText)
    return Error{fmt::format("a colouring of {} bytes, limit {}", text.size(), kMaxColouringText)};
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return Error{"what should be a colouring is no JSON object"};
  Colouring out;
  std::string map;
  for (const auto& [key, to, most] :
       {std::tuple{"array", &out.array, kMaxArrayName}, std::tuple{"unit", &out.unit, kMaxArrayName},
        std::tuple{"map", &map, colour::kMaxMapText}}) {
    auto read = read_text(json, key, most);
    if (!read) return read.error();
    *to = *std::move(read);
  }
  for (const auto& [key, to] : {std::pair{"lo", &out.lo}, std::pair{"hi", &out.hi}, std::pair{"origin", &out.origin}}) {
    const auto read = read_number(json, key);
    if (!read) return read.error();
    *to = *read;
  }
  if (out.array.empty()) return Error{"a colouring names no array"};
  if (out.lo > out.hi) return Error{fmt::format("a colouring's range begins at {} and ends at {}", out.lo, out.hi)};
  auto read_map = colour::from_text(map);
  if (!read_map) return read_map.error();
  out.map = *std::move(read_map);
  return out;
}

Result<ColourBy> parse_colour_by(std::string_view text) {
  if (text.empty() || text == kNoArray) return ColourBy{};
  const size_t last = text.rfind(':');
  const size_t first = last == std::string_view::npos || last == 0 ? last : text.rfind(':', last - 1);
  if (first == std::string_view::npos || first == 0 || first == last) return ColourBy{std::string(text)};
  const auto lo = number(text.substr(first + 1, last - first - 1)), hi = number(text.substr(last + 1));
  if (!lo || !hi) return ColourBy{std::string(text)};
  for (const double v : {*lo, *hi})
    if (!fits(v)) return Error{fmt::format("\"{}\": the range's end {} is not within +-{:g}", text, v, kMaxScalar)};
  if (!(*lo < *hi)) return Error{fmt::format("\"{}\": MIN is {}, which is not below MAX, {}", text, *lo, *hi)};
  return ColourBy{std::string(text.substr(0, first)), true, *lo, *hi};
}

Result<Colouring> make_colouring(std::span<const ArrayInfo> arrays, const ColourBy& by, colour::ColourMap map) {
  const auto choice = choose_array(arrays, by.array);
  if (!choice) return choice.error();
  const ValueSpan span = span_of(arrays, *choice);
  if (span.empty()) return Error{fmt::format("the array {} has no finite value", choice->name)};
  Colouring out{choice->name, arrays[choice->index].unit, span.lo, span.hi, scalar_origin(span), std::move(map)};
  if (by.has_range) out.lo = by.lo, out.hi = by.hi;
  if (!fits(out.lo) || !fits(out.hi))
    return Error{fmt::format("the array {} reaches from {} to {}; the limits are +-{:g}", choice->name, out.lo, out.hi,
                             kMaxScalar)};
  return out;
}

double scalar_origin(const ValueSpan& span) {
  if (span.empty()) return 0;
  const double farthest = std::max(std::abs(span.lo), std::abs(span.hi));
  // Floats have 24 bits: if the span is at least a thousandth of the size, they resolve 16,000 values.
  return farthest > 1000 * (span.hi - span.lo) ? span.lo : 0;
}

float stored_scalar(double value, double origin) {
  constexpr double kLargest = 1e38;
  const double moved = value - origin;
  if (!std::isfinite(moved)) return std::numeric_limits<float>::quiet_NaN();
  return static_cast<float>(std::clamp(moved, -kLargest, kLargest));
}

ColourTable make_table(const Colouring& c) {
  ColourTable out;
  constexpr int n = ColourTable::kEntries;
  out.lo = stored_scalar(c.lo, c.origin);
  const float extent = stored_scalar(c.hi, c.origin) - out.lo;
  if (extent > 0 && std::isfinite(float(n) / extent))
    out.scale = float(n) / extent;
  else
    out.offset = float(n) / 2;
  for (int i = 0; i < n; ++i) out.colours.push_back(c.map.at((i + 0.5) / n));
  out.colours.push_back(c.map.missing);
  return out;
}

}  // namespace telesplat::scene
