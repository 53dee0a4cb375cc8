#include "tools/health/health.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace telesplat::health {
namespace {

std::string text(const nlohmann::json& object, const char* key) {
  const auto it = object.find(key);
  return it != object.end() && it->is_string() ? it->get<std::string>() : std::string();
}

bool fits(const std::string& wanted, const std::string& value) { return wanted.empty() || wanted == value; }

std::string describe(const Subject& s) {
  std::string out = s.role.empty() ? "process" : s.role;
  if (!s.name.empty()) out += " named " + s.name;
  if (!s.host.empty()) out += " on " + s.host;
  return out;
}

}  // namespace

Status check(std::string_view status, const Subject& subject) {
  const auto json = nlohmann::json::parse(status, nullptr, false);
  if (!json.is_object() || !json.contains("processes") || !json["processes"].is_array())
    return Error{"the master's answer is not a status"};
  if (subject.role.empty() && subject.name.empty() && subject.host.empty()) return ok_status();
  std::string wrong = "none takes part in the session";
  for (const auto& p : json["processes"]) {
    if (!p.is_object() || !fits(subject.role, text(p, "role")) || !fits(subject.name, text(p, "name"))) continue;
    const auto facts = p.find("facts");
    if (!subject.host.empty() && (facts == p.end() || !facts->is_object() || text(*facts, "host") != subject.host))
      continue;
    const auto alive = p.find("alive"), silent = p.find("silent_s");
    if (alive == p.end() || !alive->is_boolean() || !alive->get<bool>()) {
      wrong = text(p, "name") + " has left the session";
      continue;
    }
    if (silent == p.end() || !silent->is_number() || silent->get<double>() > kSilent_s) {
      wrong = fmt::format("{} has said nothing for more than {} s", text(p, "name"), kSilent_s);
      continue;
    }
    return ok_status();
  }
  return Error{fmt::format("no healthy {}: {}", describe(subject), wrong)};
}

}  // namespace telesplat::health
