#include "services/master/master_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <set>

#include "common/core/log.h"
#include "common/julia/parameters.h"
#include "common/options/table.h"
#include "common/scene/session.h"
#include "services/master/record/about.h"

namespace telesplat::master {

namespace {

using options::quoted;
using Processes = std::vector<metrics::Process>;

std::string run_table(const metrics::About& about, const Processes& processes) {
  std::string out =
      fmt::format("[run]\nid = {}\nversion = {}\nbegin = {}\nbegin_monotonic_s = {:.9f}\n", quoted(about.id),
                  quoted(about.version), quoted(metrics::iso_time(about.begin.unix_ns)), about.begin.monotonic_s);
  if (about.end_unix_ns) out += fmt::format("end = {}\n", quoted(metrics::iso_time(about.end_unix_ns)));
  if (const std::string by = metrics::Roster(processes).fact("master", "launched_by"); !by.empty())
    out += fmt::format("command = {}\n", quoted(by));
  return out;
}

std::string session_table(const MasterServiceOptions& o, const MasterCore& core) {
  const auto& s = o.master.schedule;
  std::string out = fmt::format(
      "\n[session]\ntile_size = {}\nframes_in_flight = {}\nlease_timeout_s = {}\nlease_target_s = {}\n"
      "octree_depth = {}\nprogressive = {}\nanimation = {}\n\n[settings]\n",
      s.tile_size, s.frames_in_flight, s.lease_timeout_s, s.lease_target_s, core.octree_depth(),
      quoted(core.progressive() ? "on" : "off"), quoted(core.animation()));
  for (const auto& [key, value] : wire::numbers_of(core.settings()))
    out += fmt::format("{} = {}\n", quoted(key), value);
  return out;
}

std::string process_table(const metrics::Process& p) {
  std::string out = fmt::format("\n[[process]]\nrole = {}\nname = {}\n", quoted(p.role), quoted(p.name));
  // A key twice would make the file unreadable. [run] has launched_by.
  std::set<std::string> written{quoted("role"), quoted("name"), quoted(metrics::kRecordFact), quoted("launched_by")};
  for (const auto& [key, value] : p.facts)
    if (const std::string name = quoted(key); written.insert(name).second)
      out += fmt::format("{} = {}\n", name, quoted(value));
  return out;
}

// Returns the tables of the first process of a role that sent some; a viewer that records into the folder itself wins.
std::string told_by(const Processes& processes, const std::string& role) {
  const metrics::Process* found = nullptr;
  for (const auto& p : processes) {
    if (p.role != role || p.replaced || !p.facts.contains(metrics::kRecordFact)) continue;
    if (!found || scene::value_or(p.facts, "records_in", std::string()) == ".") found = &p;
  }
  if (!found) return {};
  const auto told = checked(role, found->facts.at(metrics::kRecordFact));
  if (!told || told->left_out > 0)
    log::warn("{} {} tells session.toml what is no {} of it: {}", found->role, found->name, told ? "key" : "table",
              told ? fmt::format("{} left out", told->left_out) : told.error().text);
  return told ? told->text : std::string();
}

}  // namespace

std::string session_text(const MasterServiceOptions& o, const MasterCore& core, const metrics::About& about,
                         const Processes& processes) {
  std::string out =
      "# The effective configuration of this run.\n" + run_table(about, processes) + session_table(o, core);
  for (const auto& p : processes) out += process_table(p);
  return out + told_by(processes, "data") + told_by(processes, "viewer");
}

namespace {

constexpr size_t kMostNumbers = 16;  // elements of an array

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
