#include "services/master/peers/told_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <optional>

#include "common/julia/parameters.h"
#include "common/options/table.h"

namespace telesplat::master {
namespace {

constexpr size_t kMostNumbers = 16;  // of an array

template <class Map>
std::vector<std::string> keys_of(const Map& map, std::vector<std::string> more = {}) {
  for (const auto& [key, value] : map) more.push_back(key);
  return more;
}

std::optional<std::string> number_text(const toml::node& node) {
  if (const auto* whole = node.as_integer()) return fmt::format("{}", **whole);
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", **number);
  return std::nullopt;
}

std::optional<std::string> value_text(const toml::node& node) {
  if (const auto* text = node.as_string()) return options::quoted(**text);
  if (const auto* on = node.as_boolean()) return **on ? "true" : "false";
  const auto* array = node.as_array();
  if (!array) return number_text(node);
  if (array->size() > kMostNumbers) return std::nullopt;
  std::vector<std::string> numbers;
  for (const auto& element : *array) {
    auto number = number_text(element);
    if (!number) return std::nullopt;
    numbers.push_back(*std::move(number));
  }
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

void write(const ToldTable& known, const toml::table& table, Told& out) {
  out.text += fmt::format("\n[{}]\n", known.name);
  size_t written = 0;
  for (const std::string& key : known.keys) {
    const toml::node* node = table.get(key);
    const auto value = node ? value_text(*node) : std::nullopt;
    if (!value) continue;
    const bool dotted = key.find('.') != key.npos;
    out.text += fmt::format("{} = {}\n", dotted ? options::quoted(key) : key, *value);
    ++written;
  }
  out.left_out += table.size() - written;
}

}  // namespace

const std::vector<ToldTable>& told_tables(const std::string& role) {
  static const std::vector<ToldTable> none,
      data{{"scene", {"kind",     "file",     "title",          "room_size", "up",         "crease_angle",
                      "z_scale",  "texture",  "texture_detail", "colour_by", "colour_map", "cache",
                      "no_cache", "raw",      "series",         "spacing",   "array",      "iso",
                      "tf",       "lighting", "series_rate",    "animate"}},
           {"julia", keys_of(julia::to_map(julia::Parameters{}))},
           {"placement", keys_of(julia::to_map(julia::Placement{}), {"lo", "hi"})}},
      viewer{{"display",
              {"size", "fov", "near", "background", "shading", "legend", "stereo", "eye_separation", "screen_distance",
               "swap_eyes", "barrier", "stereo_pattern"}}};
  return role == "data" ? data : role == "viewer" ? viewer : none;
}

Result<Told> checked(const std::string& role, const std::string& said) {
  try {
    const toml::table all = toml::parse(said);
    Told out;
    size_t known = 0;
    for (const ToldTable& table : told_tables(role)) {
      const auto* found = all.get_as<toml::table>(table.name);
      if (!found) continue;
      write(table, *found, out);
      ++known;
    }
    out.left_out += all.size() - known;
    return out;
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("line {}: {}", e.source().begin.line, e.description())};
  }
}

}  // namespace telesplat::master
