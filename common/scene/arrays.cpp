#include "common/scene/arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "common/core/utf8.h"

namespace telesplat::scene {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kNamesTold = 20;     // names listed in an error
constexpr size_t kMostSpanText = 52;  // bytes: two numbers with all digits

std::string names_of(std::span<const ArrayInfo> arrays) {
  std::string out;
  for (size_t i = 0; i < std::min(arrays.size(), kNamesTold); ++i)
    out += fmt::format("{}{}{}", i ? ", " : "", arrays[i].name, arrays[i].components > 1 ? " (.x, .y ...)" : "");
  if (arrays.size() > kNamesTold) out += fmt::format(" and {} more", arrays.size() - kNamesTold);
  return out;
}

// A suffix of an array's name that selects a component, ".x" or "[12]": the component's number, the suffix's length.
struct Suffix {
  int component;
  size_t bytes;
};
std::optional<Suffix> suffix_of(std::string_view text) {
  if (text.size() > 2 && text[text.size() - 2] == '.') {
    const size_t at = std::string_view("xyzw").find(text.back());
    if (at != std::string_view::npos) return Suffix{int(at), 2};
  }
  const size_t open = text.rfind('[');
  if (open == std::string_view::npos || !text.ends_with(']')) return std::nullopt;
  int component = -1;
  const char* end = text.data() + text.size() - 1;
  const auto parsed = std::from_chars(text.data() + open + 1, end, component);
  if (parsed.ec != std::errc() || parsed.ptr != end || component < 0) return std::nullopt;
  return Suffix{component, text.size() - open};
}

// Returns UTF-8 without characters that would steer a terminal.
std::string plain(const std::string& text) {
  std::string out = to_utf8(text);
  for (size_t i = 0; i < out.size(); ++i) {
    const auto byte = static_cast<unsigned char>(out[i]);
    if (byte < 0x20 || byte == 0x7f) out[i] = '?';
    if (byte == 0xc2 && static_cast<unsigned char>(out[i + 1]) < 0xa0) out.replace(i, 2, "?");  // U+0080 to U+009F
  }
  return out;
}

// Cuts a text between characters.
std::string shortened(const std::string& text, size_t bytes) {
  if (text.size() <= bytes) return text;
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xc0) == 0x80) --bytes;
  return text.substr(0, bytes);
}

Json span_json(const ValueSpan& span) { return span.empty() ? Json() : Json::array({span.lo, span.hi}); }

Json array_json(const ArrayInfo& a) {
  Json spans = Json::array();
  for (const ValueSpan& s : a.spans) spans.push_back(span_json(s));
  Json out{{"name", a.name}, {"unit", a.unit}, {"cells", a.of_cells}, {"components", a.components}, {"spans", spans}};
  if (!a.histogram.empty()) out["histogram"] = a.histogram;
  return out;
}

std::string text_of(const ArrayInfo& a) { return array_json(a).dump(-1, ' ', false, Json::error_handler_t::replace); }

std::optional<ValueSpan> read_span(const Json& json) {
  if (json.is_null()) return ValueSpan{};
  if (!json.is_array() || json.size() != 2 || !json[0].is_number() || !json[1].is_number()) return std::nullopt;
  const ValueSpan out{json[0].get<double>(), json[1].get<double>()};
  if (!std::isfinite(out.lo) || !std::isfinite(out.hi) || out.empty()) return std::nullopt;
  return out;
}

std::optional<std::string> read_name(const Json& json, const char* key, bool may_be_empty) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) return std::nullopt;
  auto text = found->get<std::string>();
  if ((text.empty() && !may_be_empty) || text.size() > kMaxArrayName || !valid_utf8(text)) return std::nullopt;
  return text;
}

std::optional<ArrayInfo> read_array(const Json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto name = read_name(json, "name", false), unit = read_name(json, "unit", true);
  const auto cells = json.find("cells"), components = json.find("components"), spans = json.find("spans");
  if (!name || !unit || cells == json.end() || !cells->is_boolean() || components == json.end() ||
      !components->is_number_unsigned() || components->get<uint64_t>() < 1 || components->get<uint64_t>() > 1u << 20 ||
      spans == json.end() || !spans->is_array() || spans->empty() || spans->size() > size_t{kMaxComponents} + 1)
    return std::nullopt;
  ArrayInfo out{*name, *unit, cells->get<bool>(), components->get<int>(), {}};
  if (const auto histogram = json.find("histogram"); histogram != json.end()) {
    if (!histogram->is_string()) return std::nullopt;
    out.histogram = histogram->get<std::string>();
  }
  for (const Json& s : *spans) {
    const auto span = read_span(s);
    if (!span) return std::nullopt;
    out.spans.push_back(*span);
  }
  return out;
}

}  // namespace

void ValueSpan::add(double value) {
  if (!std::isfinite(value)) return;
  lo = std::min(lo, value);
  hi = std::max(hi, value);
}

Result<ArrayChoice> choose_array(std::span<const ArrayInfo> arrays, std::string_view text) {
  const auto find = [&](std::string_view name) {
    return std::find_if(arrays.begin(), arrays.end(), [&](const ArrayInfo& a) { return a.name == name; });
  };
  const auto index = [&](auto found) { return size_t(found - arrays.begin()); };
  if (const auto whole = find(text); whole != arrays.end()) return ArrayChoice{index(whole), -1, std::string(text)};
  const std::string shown = to_utf8(text.substr(0, 80));
  if (const auto suffix = suffix_of(text)) {
    const auto found = find(text.substr(0, text.size() - suffix->bytes));
    if (found != arrays.end()) {
      const int most = std::min(found->components, kMaxComponents);
      if (suffix->component >= most)
        return Error{fmt::format("\"{}\": the array {} has {} component{}", shown, found->name, found->components,
                                 found->components == 1 ? "" : "s, of which the first 9 can be chosen")};
      return ArrayChoice{index(found), found->components == 1 ? -1 : suffix->component, std::string(text)};
    }
  }
  if (arrays.empty()) return Error{fmt::format("there is no array \"{}\": the file has no arrays of numbers", shown)};
  return Error{fmt::format("there is no array \"{}\"; there are: {}", shown, names_of(arrays))};
}

ValueSpan span_of(std::span<const ArrayInfo> arrays, const ArrayChoice& choice) {
  const auto& spans = arrays[choice.index].spans;
  const size_t at = size_t(choice.component + 1);
  return at < spans.size() ? spans[at] : ValueSpan{};
}

void make_tellable(std::vector<ArrayInfo>& arrays) {
  if (arrays.size() > kMaxArrays) arrays.resize(kMaxArrays);
  std::set<std::string> taken;
  for (size_t i = 0; i < arrays.size(); ++i) {
    ArrayInfo& a = arrays[i];
    a.unit = shortened(plain(a.unit), kMaxArrayName);
    const std::string name = a.name.empty() ? fmt::format("array {}", i + 1) : shortened(plain(a.name), 200);
    a.name = name;
    if (taken.contains(a.name) && a.of_cells) a.name = name + " (cell)";
    for (int n = 2; taken.contains(a.name); ++n) a.name = fmt::format("{} ({})", name, n);
    taken.insert(a.name);
  }
  // Leaves room for spans that are found later.
  const auto most_bytes = [](const ArrayInfo& a) { return text_of(a).size() + 1 + a.spans.size() * kMostSpanText; };
  size_t bytes = 2, told = 0;
  while (told < arrays.size() && (bytes += most_bytes(arrays[told])) <= kMaxArraysText) ++told;
  arrays.resize(told);
}

std::string to_text(std::span<const ArrayInfo> arrays) {
  std::string out = "[";
  for (const ArrayInfo& a : arrays) out += (out.size() > 1 ? "," : "") + text_of(a);
  return out + "]";
}

Result<std::vector<ArrayInfo>> arrays_from_text(std::string_view text) {
  std::vector<ArrayInfo> out;
  if (text.empty()) return out;
  if (text.size() > kMaxArraysText)
    return Error{fmt::format("a list of arrays of {} bytes, limit {}", text.size(), kMaxArraysText)};
  const Json list = Json::parse(text, nullptr, false);
  if (!list.is_array() || list.size() > kMaxArrays)
    return Error{fmt::format("what should list arrays is no list of at most {}", kMaxArrays)};
  for (const Json& json : list) {
    auto array = read_array(json);
    if (!array) return Error{fmt::format("entry {} of a list of arrays is none", out.size() + 1)};
    out.push_back(*std::move(array));
  }
  return out;
}

}  // namespace telesplat::scene
