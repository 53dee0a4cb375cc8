#include "tools/telesplat/scene/recorded_julia.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

namespace telesplat::launcher {
namespace {

constexpr size_t kMaxEpochs = 1'000'000, kMaxLine = 1 << 14;

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> out;
  for (size_t begin = 0;;) {
    const size_t comma = line.find(',', begin);
    out.push_back(line.substr(begin, comma - begin));
    if (comma == std::string_view::npos) return out;
    begin = comma + 1;
  }
}

std::map<std::string, double> numbers_of(const toml::node_view<toml::node>& table) {
  std::map<std::string, double> out;
  if (const auto* t = table.as_table())
    for (const auto& [key, node] : *t)
      if (const auto value = node.value<double>()) out[std::string(key.str())] = *value;
  return out;
}

Result<glm::vec3> corner(const std::string& path, toml::table& table, const char* key) {
  const auto* array = table["placement"][key].as_array();
  glm::vec3 out(NAN);
  if (array && array->size() == 3)
    for (int i = 0; i < 3; ++i) out[i] = float(array->get(size_t(i))->value<double>().value_or(NAN));
  if (!std::isfinite(out.x + out.y + out.z))
    return Error{fmt::format("{}: key {} of [placement] is not three numbers", path, key)};
  return out;
}

Status read_session(const std::string& path, RecordedJulia& out) {
  try {
    toml::table table = toml::parse_file(path);
    out.title = table["scene"]["title"].value_or(std::string(julia::kSceneWord));
    out.animate = table["scene"]["animate"].value_or(std::string());
    auto begin = julia::from_map(numbers_of(table["julia"]));
    if (begin)
      if (const Status s = julia::validate(*begin); !s) begin = s.error();
    if (!begin) return Error{fmt::format("{}: {}", path, begin.error().text)};
    out.begin = *begin;
    const auto lo = corner(path, table, "lo"), hi = corner(path, table, "hi");
    if (!lo) return lo.error();
    if (!hi) return hi.error();
    const auto placement = julia::placement_from_map(numbers_of(table["placement"]), {*lo, *hi});
    if (!placement) return Error{fmt::format("{}: {}", path, placement.error().text)};
    if (placement->box_room.empty())
      return Error{fmt::format("{}: the box of [placement] is empty: lo is not below hi", path)};
    out.placement = *placement;
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
  return ok_status();
}

Status read_epochs(const std::string& path, RecordedJulia& out) {
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line)) return Error{fmt::format("{}: is empty", path)};
  std::vector<std::string> names;
  for (const auto field : fields_of(line)) names.emplace_back(field);
  if (names.empty() || names.front() != "epoch") return Error{fmt::format("{}: the first column is not epoch", path)};
  for (size_t row = 2; std::getline(in, line); ++row) {
    const auto wrong = [&](const std::string& what) { return Error{fmt::format("{}:{}: {}", path, row, what)}; };
    if (line.size() > kMaxLine) return wrong(fmt::format("a line of more than {} bytes", kMaxLine));
    if (out.epochs.size() == kMaxEpochs) return wrong(fmt::format("more than {} epochs", kMaxEpochs));
    const auto fields = fields_of(line);
    if (fields.size() != names.size())
      return wrong(fmt::format("{} values instead of {}", fields.size(), names.size()));
    std::map<std::string, double> values;
    for (size_t i = 0; i < names.size(); ++i) {
      double value = 0;
      const auto end = fields[i].data() + fields[i].size();
      const auto read = std::from_chars(fields[i].data(), end, value);
      if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value))
        return wrong(fmt::format("{} is \"{}\", not a number", names[i], fields[i].substr(0, 40)));
      values[names[i]] = value;
    }
    const double epoch = values["epoch"];
    if (!(epoch >= 0 && epoch < 9e15)) return wrong(fmt::format("epoch is {}, limits are 0..9e15", epoch));
    const auto parameters = julia::from_map(values);
    if (!parameters) return wrong(parameters.error().text);
    out.epochs[uint64_t(epoch)] = *parameters;
  }
  return ok_status();
}

}  // namespace

Result<julia::Parameters> RecordedJulia::at(EpochId epoch) const {
  if (epochs.empty()) return begin;
  const auto found = epochs.find(epoch.value);
  if (found != epochs.end()) return found->second;
  return Error{fmt::format("{}/epochs.csv: has no epoch {}; it holds {} to {}", directory, epoch.value,
                           epochs.begin()->first, epochs.rbegin()->first)};
}

std::string session_tables(const julia::Scene& scene, const julia::Placement& placement, double room_size_m) {
  std::string out =
      fmt::format("\n[scene]\nkind = \"julia\"\ntitle = \"{}\"\nroom_size = {}\n", scene.title, room_size_m);
  if (!scene.timeline.empty()) out += fmt::format("animate = \"{}\"\n", scene.timeline.text());
  out += "\n[julia]\n";
  for (const auto& [name, value] : julia::to_map(scene.parameters)) out += fmt::format("\"{}\" = {}\n", name, value);
  out += "\n[placement]\n";
  for (const auto& [name, value] : julia::to_map(placement)) out += fmt::format("\"{}\" = {}\n", name, value);
  const auto& box = placement.box_room;
  out +=
      fmt::format("lo = [{}, {}, {}]\nhi = [{}, {}, {}]\n", box.lo.x, box.lo.y, box.lo.z, box.hi.x, box.hi.y, box.hi.z);
  return out;
}

Result<RecordedJulia> read_recorded_julia(const std::string& directory) {
  RecordedJulia out;
  out.directory = directory;
  if (const Status s = read_session(directory + "/session.toml", out); !s) return s.error();
  std::error_code error;
  if (const std::string path = directory + "/epochs.csv"; std::filesystem::exists(path, error))
    if (const Status s = read_epochs(path, out); !s) return s.error();
  return out;
}

}  // namespace telesplat::launcher
