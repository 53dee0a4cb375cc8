#include "tools/telesplat/sweep/manifest.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/core/utf8.h"
#include "common/core/whole_file.h"
#include "tools/common/json_file.h"

namespace telesplat::launcher {
namespace {

using nlohmann::ordered_json;

constexpr int kSchema = 1;

ordered_json to_json(const Grid& grid) {
  auto axes = ordered_json::array();
  for (const Axis& a : grid.axes) axes.push_back({{"flag", a.flag}, {"values", a.values}});
  return {{"scene", grid.scene},
          {"flags", grid.flags},
          {"vary", axes},
          {"repeat", grid.repeat},
          {"shuffle", grid.shuffle ? ordered_json(*grid.shuffle) : ordered_json()}};
}

ordered_json to_json(const RunKey& key, const RunOutcome& o) {
  return {{"configuration", key.first}, {"repetition", key.second},  {"done", o.done},
          {"attempts", o.attempts},     {"exit_code", o.exit_code},  {"reason", to_utf8(o.reason)},
          {"begin", o.begin},           {"wall_s", o.wall_s},        {"load_before", o.load.before},
          {"load_after", o.load.after}, {"own_cpu", o.load.own_cpu}, {"others_cpu", o.load.others_cpu}};
}

Grid grid_of(const ordered_json& j) {
  Grid out;
  out.scene = j.at("scene").get<std::string>();
  out.flags = j.at("flags").get<std::vector<std::string>>();
  for (const auto& a : j.at("vary")) out.axes.push_back({a.at("flag"), a.at("values")});
  out.repeat = j.at("repeat").get<int>();
  if (!j.at("shuffle").is_null()) out.shuffle = j.at("shuffle").get<uint64_t>();
  return out;
}

RunOutcome outcome_of(const ordered_json& j) {
  return {j.at("done"),
          j.at("attempts"),
          j.at("exit_code"),
          j.at("reason"),
          j.at("begin"),
          j.at("wall_s"),
          {j.at("load_before"), j.at("load_after"), j.at("own_cpu"), j.at("others_cpu")}};
}

Manifest manifest_of(const ordered_json& j) {
  Manifest out;
  out.grid = grid_of(j.at("grid"));
  out.version = j.at("version").get<std::string>();
  out.directory = j.at("directory").get<std::string>();
  for (const auto& c : j.at("configurations")) out.configurations.push_back({c.at("name"), c.at("values")});
  for (const auto& r : j.at("runs")) out.outcomes[{r.at("configuration"), r.at("repetition")}] = outcome_of(r);
  return out;
}

// What a person may have broken by hand: names become paths.
bool is_whole(const Manifest& m) {
  for (const Configuration& c : m.configurations)
    if (c.values.size() != m.grid.axes.size() || c.name.empty() || c.name.find('/') != c.name.npos || c.name == "..")
      return false;
  size_t cells = 1;
  for (const Axis& a : m.grid.axes) cells *= a.values.size();
  return cells == m.configurations.size() && m.grid.repeat >= 1 && m.grid.repeat <= kMostRepetitions;
}

}  // namespace

Result<std::optional<Manifest>> read_manifest(const std::string& directory) try {
  const std::string path = directory + "/" + kManifestFile;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::optional<Manifest>();
  const auto j = tools::read_json_file(path);
  if (const int schema = j.at("schema"); schema != kSchema)
    return Error{fmt::format("{}: has schema {}, this program reads {}", path, schema, kSchema)};
  Manifest out = manifest_of(j);
  if (!is_whole(out)) return Error{fmt::format("{}: is no record of a sweep", path)};
  return std::optional(std::move(out));
} catch (const nlohmann::json::exception&) {
  return Error{fmt::format("{}/{}: is no record of a sweep", directory, kManifestFile)};
}

Status write_manifest(const Manifest& m, const std::string& directory) try {
  ordered_json j{{"schema", kSchema}, {"version", m.version}, {"directory", m.directory}, {"grid", to_json(m.grid)}};
  j["configurations"] = ordered_json::array();
  for (const Configuration& c : m.configurations)
    j["configurations"].push_back({{"name", c.name}, {"values", c.values}});
  j["runs"] = ordered_json::array();
  for (const auto& [key, outcome] : m.outcomes) j["runs"].push_back(to_json(key, outcome));
  return write_whole(directory + "/" + kManifestFile,
                     j.dump(2, ' ', false, decltype(j)::error_handler_t::replace) + "\n");
} catch (const nlohmann::json::exception&) {
  return Error{"a flag or a file's name is not UTF-8, so the sweep cannot be recorded"};
}

Error holds_another(const std::string& folder, const char* holds, const std::string& difference) {
  return {
      fmt::format("{}: holds another {}: {}; name all that it has, or give another --out", folder, holds, difference)};
}

Manifest begin_manifest(Grid grid, std::string version, std::string directory) {
  Manifest out{std::move(grid), std::move(version), std::move(directory), {}, {}};
  out.configurations = configurations(out.grid);
  return out;
}

Status extend(Manifest& m, const Grid& wanted) {
  if (const Status s = check_extends(m.grid, wanted); !s) return s;
  const Names names = names_of(m.grid, m.configurations);
  m.grid = wanted;
  m.configurations = configurations(m.grid, names);
  return ok_status();
}

}  // namespace telesplat::launcher
