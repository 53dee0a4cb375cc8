#include "tools/telesplat/sweep/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "common/core/utf8.h"
#include "common/core/whole_file.h"
#include "common/options/suggest.h"
#include "tools/common/json_file.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kLongestFolder = 120;  // bytes of a folder's name; file systems take 255
constexpr const char* kScene = "scene";

bool is_plain_flag(const options::Row& row) { return std::holds_alternative<bool*>(row.value) && !row.on_off; }

std::string dashed(const std::string& flag) { return flag == kScene ? flag : "--" + flag; }

Result<const options::Row*> row_of(const std::string& flag, const options::Table& flags) {
  const options::Row* row = options::find(flags, dashed(flag));
  if (row) return row;
  std::vector<std::string> known;
  for (const auto& r : flags) {
    const std::string name = options::name_of(r);
    known.push_back(name.starts_with("--") ? name.substr(2) : name);
  }
  return Error{fmt::format("--vary {}: no such flag of telesplat run{}", flag.substr(0, 200),
                           options::did_you_mean(flag, known))};
}

Status check_value(const options::Row& row, const std::string& value) {
  const std::string name = options::name_of(row);
  if (is_plain_flag(row))
    return value == "on" || value == "off" ? ok_status()
                                           : Status(Error{fmt::format("{} {}: is neither on nor off", name, value)});
  return options::check(row, value);
}

std::vector<std::string> split_values(const std::string& text) {
  const char separator = text.find(';') == text.npos ? ',' : ';';
  std::vector<std::string> out;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    out.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (separator == ';' && out.back().empty()) out.pop_back();
  return out;
}

// Shortens a scene to its file's name, without folder and ending.
std::string shown_value(const std::string& flag, const std::string& value) {
  const std::string stem = flag == kScene ? std::filesystem::path(value).stem().string() : value;
  return stem.empty() ? value : stem;
}

std::string name_for(const Grid& grid, const std::vector<std::string>& values) {
  std::string out;
  for (size_t i = 0; i < values.size(); ++i)
    out += fmt::format("{}{}-{}", i ? "_" : "", grid.axes[i].flag, shown_value(grid.axes[i].flag, values[i]));
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.' || c == '+';
  };
  for (char& c : out)
    if (!is_plain(c)) c = '-';
  if (out.empty()) out = "run";
  return out.substr(0, kLongestFolder);
}

std::map<std::string, std::string> key_of(const Grid& grid, const Configuration& c) {
  std::map<std::string, std::string> out;
  for (size_t i = 0; i < grid.axes.size(); ++i) out[grid.axes[i].flag] = c.values[i];
  return out;
}

const Axis* axis_of(const Grid& grid, const std::string& flag) {
  const auto found = std::find_if(grid.axes.begin(), grid.axes.end(), [&](const Axis& a) { return a.flag == flag; });
  return found == grid.axes.end() ? nullptr : &*found;
}

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
  return {{"configuration", key.first}, {"repetition", key.second},    {"done", o.done},   {"attempts", o.attempts},
          {"exit_code", o.exit_code},   {"reason", to_utf8(o.reason)}, {"begin", o.begin}, {"wall_s", o.wall_s}};
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
  return {j.at("done"), j.at("attempts"), j.at("exit_code"), j.at("reason"), j.at("begin"), j.at("wall_s")};
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

// Checks what an edit by hand may have broken: names become paths.
bool is_whole(const Manifest& m) {
  for (const Configuration& c : m.configurations)
    if (c.values.size() != m.grid.axes.size() || c.name.empty() || c.name.find('/') != c.name.npos || c.name == "..")
      return false;
  size_t cells = 1;
  for (const Axis& a : m.grid.axes) cells *= a.values.size();
  return cells == m.configurations.size() && m.grid.repeat >= 1 && m.grid.repeat <= kMostRepetitions;
}

}  // namespace

Status add_axis(const std::string& text, const options::Table& flags, std::vector<Axis>& axes) {
  const size_t equals = text.find('=');
  if (equals == text.npos || equals + 1 == text.size())
    return Error{fmt::format("--vary {}: is not FLAG=VALUE,VALUE,...", text.substr(0, 200))};
  const std::string given = text.substr(0, equals);
  const auto row = row_of(given.starts_with("--") ? given.substr(2) : given, flags);
  if (!row) return row.error();
  const std::string name = options::name_of(**row), flag = name.starts_with("--") ? name.substr(2) : name;
  auto axis = std::find_if(axes.begin(), axes.end(), [&](const Axis& a) { return a.flag == flag; });
  if (axis == axes.end()) axis = axes.insert(axes.end(), Axis{flag, {}});
  for (const std::string& value : split_values(text.substr(equals + 1))) {
    if (value.empty()) return Error{fmt::format("--vary {}: has an empty value", text.substr(0, 200))};
    if (const Status s = check_value(**row, value); !s) return s;
    if (std::find(axis->values.begin(), axis->values.end(), value) != axis->values.end())
      return Error{fmt::format("--vary {}: {} stands there twice", flag, value)};
    axis->values.push_back(value);
  }
  return ok_status();
}

std::vector<Configuration> configurations(const Grid& grid, const Names& known) {
  std::vector<Configuration> out{{}};
  for (const Axis& axis : grid.axes) {
    std::vector<Configuration> longer;
    for (const Configuration& c : out)
      for (const std::string& value : axis.values) {
        longer.push_back(c);
        longer.back().values.push_back(value);
      }
    out = std::move(longer);
  }
  std::set<std::string> taken;
  for (const auto& [key, name] : known) taken.insert(name);
  for (Configuration& c : out) {
    if (const auto found = known.find(key_of(grid, c)); found != known.end()) {
      c.name = found->second;
      continue;
    }
    const std::string name = name_for(grid, c.values);
    c.name = name;
    for (int n = 2; !taken.insert(c.name).second; ++n) c.name = fmt::format("{}-{}", name, n);
  }
  return out;
}

Names names_of(const Grid& grid, const std::vector<Configuration>& configurations) {
  Names out;
  for (const Configuration& c : configurations) out[key_of(grid, c)] = c.name;
  return out;
}

std::string words(const Grid& grid, const Configuration& configuration) {
  std::string out;
  for (size_t i = 0; i < grid.axes.size(); ++i)
    out += fmt::format("{}{}={}", i ? " " : "", grid.axes[i].flag,
                       shown_value(grid.axes[i].flag, configuration.values[i]));
  return out.empty() ? "all runs" : out;
}

std::vector<std::string> arguments(const Grid& grid, const Configuration& configuration, const options::Table& flags) {
  std::vector<std::string> out;
  if (!grid.scene.empty()) out.push_back(grid.scene);
  out.insert(out.end(), grid.flags.begin(), grid.flags.end());
  for (size_t i = 0; i < grid.axes.size(); ++i) {
    const std::string &flag = grid.axes[i].flag, &value = configuration.values[i];
    const options::Row* row = options::find(flags, dashed(flag));
    if (flag == kScene)
      out.insert(out.begin(), value);
    else if (!row || !is_plain_flag(*row))
      out.push_back(fmt::format("{}={}", dashed(flag), value));
    else if (value == "on")
      out.push_back(dashed(flag));
  }
  return out;
}

std::vector<PlannedRun> run_order(const Grid& grid, size_t configurations) {
  std::vector<PlannedRun> out;
  for (int repetition = 1; repetition <= grid.repeat; ++repetition) {
    const size_t first = out.size();
    for (size_t c = 0; c < configurations; ++c) out.push_back({c, repetition});
    if (!grid.shuffle) continue;
    // Fisher and Yates, with a generator that is the same on all machines.
    std::mt19937_64 random(*grid.shuffle + uint64_t(repetition));
    for (size_t left = configurations; left > 1; --left) std::swap(out[first + left - 1], out[first + random() % left]);
  }
  return out;
}

Status check_extends(const Grid& before, const Grid& wanted) {
  if (before.scene != wanted.scene)
    return Error{fmt::format("it is of {}, not of {}", before.scene.empty() ? "several scenes" : before.scene,
                             wanted.scene.empty() ? "several" : wanted.scene)};
  if (before.flags != wanted.flags)
    return Error{fmt::format("its runs have the flags \"{}\", not \"{}\"", fmt::join(before.flags, " "),
                             fmt::join(wanted.flags, " "))};
  for (const Axis& axis : wanted.axes)
    if (!axis_of(before, axis.flag)) return Error{fmt::format("{} does not vary in it", axis.flag)};
  for (const Axis& axis : before.axes) {
    const Axis* now = axis_of(wanted, axis.flag);
    if (!now) return Error{fmt::format("{} varies in it, too", axis.flag)};
    for (const std::string& value : axis.values)
      if (std::find(now->values.begin(), now->values.end(), value) == now->values.end())
        return Error{fmt::format("it has {}={}, too", axis.flag, value)};
  }
  if (wanted.repeat < before.repeat)
    return Error{fmt::format("it has {} runs of each configuration, not {}", before.repeat, wanted.repeat)};
  return ok_status();
}

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
