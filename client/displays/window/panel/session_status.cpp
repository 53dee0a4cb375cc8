#include "client/displays/window/panel/session_status.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace telesplat::viewer {
namespace {

using Json = nlohmann::json;

constexpr double kLongSilence_s = 3;  // processes report once a second

std::string text_of(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

Result<SessionStatus> read_status(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return Error{"the master's answer is not a status"};
  SessionStatus out;
  out.animation = text_of(json, "animation");
  if (out.animation == "off") out.animation.clear();
  const auto processes = json.find("processes");
  if (processes == json.end() || !processes->is_array()) return out;
  for (const Json& p : *processes) {
    if (!p.is_object()) continue;
    SessionStatus::Process process{.role = text_of(p, "role"), .name = text_of(p, "name")};
    if (const auto alive = p.find("alive"); alive != p.end() && alive->is_boolean()) process.alive = alive->get<bool>();
    if (const auto silent = p.find("silent_s"); silent != p.end() && silent->is_number())
      process.silent_s = silent->get<double>();
    out.processes.push_back(std::move(process));
  }
  return out;
}

std::vector<std::string> missing_services(const SessionStatus& status) {
  static constexpr std::pair<const char*, const char*> kNeeded[] = {
      {"data", "waiting for a data server: nobody has the data set yet"},
      {"sampler", "waiting for a sampler: nobody samples views"},
      {"packer", "waiting for a packer: nobody packs what samplers send"}};
  std::vector<std::string> out;
  for (const auto& [role, complaint] : kNeeded) {
    bool here = false;
    const SessionStatus::Process* silent = nullptr;
    for (const auto& p : status.processes) {
      if (p.role != role || !p.alive) continue;
      here = here || p.silent_s < kLongSilence_s;
      if (p.silent_s >= kLongSilence_s) silent = &p;
    }
    if (here) continue;
    out.push_back(silent ? fmt::format("{} has said nothing for {:.0f} s", silent->name, silent->silent_s)
                         : std::string(complaint));
  }
  return out;
}

}  // namespace telesplat::viewer
