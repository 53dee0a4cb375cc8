#include "services/data/cloud/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "common/core/utf8.h"
#include "services/data/base/text_scanner.h"

namespace telesplat::data {
namespace {

using scene::Space;

struct Unit {
  std::string name = "m";
  double metres = 1;
};
constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937;

// Fills in names and lengths. heights: nullopt: feet if the plan is in feet, else metres.
Reference reference_of(Space space, const std::string& name, const std::optional<Unit>& plan,
                       const std::optional<Unit>& heights) {
  Reference out;
  scene::Coordinates& c = out.coordinates;
  c.space = space;
  c.reference = to_utf8(name.substr(0, scene::kMaxReference));
  const Unit metre, unit = plan.value_or(metre);
  const Unit up = heights ? *heights : space == Space::kProjected ? unit : metre;
  c.unit = space == Space::kGeographic ? "degrees" : to_utf8(unit.name.substr(0, scene::kMaxUnit));
  c.height_unit = to_utf8(up.name.substr(0, scene::kMaxUnit));
  c.shown = {unit.metres, unit.metres, up.metres};
  if (space == Space::kGeographic) c.shown = {1, 1, up.metres};
  if (space == Space::kProjected && !plan) out.notes.push_back("does not say its unit of length; metres are assumed");
  if (!heights && up.metres != 1)
    out.notes.push_back(fmt::format("heights are taken to be in {}, as its plan", up.name));
  return out;
}

// A part "KEYWORD[...]" of a text: what stands between its brackets. Empty: there is no such part.
std::string_view part(std::string_view text, std::initializer_list<std::string_view> keywords) {
  for (const std::string_view keyword : keywords) {
    size_t at = text.find(keyword);
    while (at != text.npos && (text.substr(at + keyword.size(), 1) != "[" ||
                               (at > 0 && std::isalpha(static_cast<unsigned char>(text[at - 1])))))
      at = text.find(keyword, at + 1);
    if (at == text.npos) continue;
    const size_t begin = at + keyword.size() + 1;
    int depth = 1;
    bool quoted = false;
    for (size_t i = begin; i < text.size(); ++i) {
      if (text[i] == '"') quoted = !quoted;
      if (quoted) continue;
      depth += (text[i] == '[') - (text[i] == ']');
      if (depth == 0) return text.substr(begin, i - begin);
    }
  }
  return {};
}

// The text in the first quotes.
std::string quoted(std::string_view text) {
  const size_t begin = text.find('"'), end = begin == text.npos ? begin : text.find('"', begin + 1);
  return end == text.npos ? "" : std::string(text.substr(begin + 1, end - begin - 1));
}

std::string unit_name(const std::string& name) {
  const std::string word = lower(name);
  return word == "metre" || word == "meter" || word == "metres" || word == "meters" ? "m" : name;
}

// The last unit of length in a part: those of its axes or of the whole.
std::optional<Unit> last_length(std::string_view text) {
  for (size_t at = text.rfind("UNIT["); at != text.npos; at = at == 0 ? text.npos : text.rfind("UNIT[", at - 1)) {
    if (at >= 5 && text.substr(at - 5, 5) == "ANGLE") continue;
    const std::string_view unit = part(text.substr(at), {"UNIT"});
    const std::string name = quoted(unit);
    TextScanner number(unit.substr(std::min(unit.find(',') + 1, unit.size())));
    double metres = 0;
    if (lower(name).find("degree") != name.npos || !number.number(metres) || !(metres > 1e-6 && metres < 1e6)) continue;
    return Unit{unit_name(name), metres};
  }
  return std::nullopt;
}

// " EPSG:2992", if the part ends with its code.
std::string code_of(std::string_view text) {
  const size_t at = std::max(text.rfind("AUTHORITY[") + 1, text.rfind("ID[") + 1);
  if (at == 0) return "";
  const std::string_view id = part(text.substr(at - 1), {"AUTHORITY", "ID"});
  if (at - 1 + id.size() + 12 < text.size()) return "";  // that of an inner part
  std::string digits;
  for (const char c : id.substr(std::min(id.find(','), id.size())))
    if (std::isdigit(static_cast<unsigned char>(c))) digits += c;
  return digits.empty() ? "" : quoted(id) + ":" + digits + " ";
}

}  // namespace

std::optional<Reference> reference_of_wkt(std::string_view text) {
  const std::string_view map = part(text, {"PROJCS", "PROJCRS", "PROJECTEDCRS"}),
                         heights = part(text, {"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"}),
                         globe = part(text, {"GEOGCS", "GEOGCRS", "GEODCRS", "GEOGRAPHICCRS"}),
                         centred = part(text, {"GEOCCS"});
  const auto up = heights.empty() ? std::nullopt : last_length(heights);
  if (!map.empty()) return reference_of(Space::kProjected, code_of(map) + quoted(map), last_length(map), up);
  if (!globe.empty()) return reference_of(Space::kGeographic, code_of(globe) + quoted(globe), std::nullopt, up);
  if (centred.empty()) return std::nullopt;
  Reference out = reference_of(Space::kPlain, quoted(centred), last_length(centred), std::nullopt);
  out.notes.push_back("has coordinates around the centre of the earth: z does not point up there (--up)");
  return out;
}

std::optional<Reference> reference_of_keys(std::span<const uint16_t> keys, std::string_view texts) {
  enum { kModel = 1024, kCitation = 1026, kGlobe = 2048, kMap = 3072, kPlanUnit = 3076, kHeightUnit = 4099 };
  const auto value_of = [&](int key) -> std::optional<uint16_t> {
    for (size_t i = 4; i + 4 <= keys.size(); i += 4)
      if (keys[i] == key && keys[i + 1] == 0) return keys[i + 3];
    return std::nullopt;
  };
  const auto unit_of = [&](int key) -> std::optional<Unit> {
    constexpr std::pair<int, std::pair<const char*, double>> kUnits[] = {
        {9001, {"m", 1}}, {9002, {"foot", kFoot}}, {9003, {"US survey foot", kSurveyFoot}}};
    const auto code = value_of(key);
    for (const auto& [number, unit] : kUnits)
      if (code == number) return Unit{unit.first, unit.second};
    return std::nullopt;
  };
  std::string name;
  for (size_t i = 4; i + 4 <= keys.size(); i += 4)
    if ((keys[i] == kCitation || ((keys[i] == 2049 || keys[i] == 3073) && name.empty())) && keys[i + 1] == 34737)
      name = texts.substr(std::min<size_t>(keys[i + 3], texts.size()), keys[i + 2]);
  while (!name.empty() && (name.back() == '|' || name.back() == '\0')) name.pop_back();
  const auto named = [&](int key) {
    const auto code = value_of(key);
    const bool own = !code || *code == 0 || *code == 32767;
    return own ? name : fmt::format("EPSG:{}{}{}", *code, name.empty() ? "" : " ", name);
  };
  const auto model = value_of(kModel);
  if (model == 1 || (!model && value_of(kMap))) {
    auto plan = unit_of(kPlanUnit);
    const int code = value_of(kMap).value_or(0);  // zones of UTM
    if (!plan && ((code > 32600 && code <= 32760) || (code > 25800 && code < 25900) || (code > 26900 && code < 26930)))
      plan = Unit();
    return reference_of(Space::kProjected, named(kMap), plan, unit_of(kHeightUnit));
  }
  if (model == 2 || (!model && value_of(kGlobe)))
    return reference_of(Space::kGeographic, named(kGlobe), std::nullopt, unit_of(kHeightUnit));
  return std::nullopt;
}

}  // namespace telesplat::data
