#include "services/master/record/about.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/core/clock.h"
#include "common/scene/session.h"

namespace telesplat::metrics {

Beginning begin_now() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return {monotonic_s(), int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec};
}

std::string iso_time(int64_t unix_ns) {
  constexpr int64_t kSecond_ns = 1'000'000'000;
  const std::time_t seconds = unix_ns / kSecond_ns;
  std::tm local{};
  localtime_r(&seconds, &local);
  char date[32];
  std::strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &local);
  const long minutes = local.tm_gmtoff / 60;
  return fmt::format("{}.{:09}{}{:02}:{:02}", date, unix_ns % kSecond_ns, minutes < 0 ? '-' : '+',
                     std::labs(minutes) / 60, std::labs(minutes) % 60);
}

size_t Roster::count(const std::string& role) const {
  return size_t(std::ranges::count_if(processes_, [&](const Process& p) { return p.role == role && !p.replaced; }));
}

size_t Roster::lost(const std::string& role) const {
  return size_t(std::ranges::count_if(processes_, [&](const Process& p) { return p.role == role && p.lost; }));
}

std::string Roster::fact(const std::string& role, const std::string& key) const {
  const std::string* found = nullptr;
  for (const Process& p : processes_) {
    const auto it = p.facts.find(key);
    if (p.role != role || p.replaced || it == p.facts.end()) continue;
    if (scene::value_or(p.facts, "records_in", std::string()) == ".") return it->second;
    if (!found) found = &it->second;
  }
  return found ? *found : "";
}

double Roster::number(const std::string& role, const std::string& key) const {
  return std::strtod(fact(role, key).c_str(), nullptr);
}

double Roster::counted(const std::string& role, const std::string& key) const {
  double sum = 0;
  for (const Process& p : processes_)
    if (role.empty() || p.role == role) sum += scene::value_or(p.values, key, 0.0);
  return sum;
}

double Roster::present(const std::string& role, const std::string& key) const {
  double sum = 0;
  for (const Process& p : processes_)
    if (p.role == role && !p.replaced) sum += scene::value_or(p.values, key, 0.0);
  return sum;
}

std::vector<double> Roster::each(const std::string& role, const std::string& key) const {
  std::vector<double> out;
  for (const Process& p : processes_)
    if (const auto it = p.values.find(key); p.role == role && it != p.values.end()) out.push_back(it->second);
  return out;
}

namespace {

using nlohmann::ordered_json;

ordered_json text_or_null(const std::string& text) { return text.empty() ? ordered_json() : ordered_json(text); }

// Returns a fact that is a number, else null. Whole numbers stay whole.
ordered_json number_or_null(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0') return {};
  if (!std::isfinite(value)) return {};
  constexpr double kMostWhole = 9007199254740992;  // 2^53
  if (std::abs(value) <= kMostWhole && value == std::floor(value)) return int64_t(value);
  return value;
}

std::string fact(const Process& p, const char* key) { return scene::value_or(p.facts, key, std::string()); }

// Returns each machine that took part, with its processes.
ordered_json machines(const std::vector<Process>& processes) {
  ordered_json out = ordered_json::array();
  for (const Process& p : processes) {
    const std::string host = fact(p, "host");
    if (host.empty() || p.replaced) continue;
    auto known = std::find_if(out.begin(), out.end(), [&](const auto& m) { return m["host"] == host; });
    if (known == out.end()) {
      out.push_back({{"host", host},
                     {"processor", nullptr},
                     {"cores", nullptr},
                     {"memory_mb", nullptr},
                     {"gpu", nullptr},
                     {"processes", ordered_json::array()}});
      known = out.end() - 1;
    }
    for (const char* key : {"processor", "gpu"})
      if (const std::string text = fact(p, key); !text.empty()) (*known)[key] = text;
    for (const char* key : {"cores", "memory_mb"})
      if (const auto value = number_or_null(fact(p, key)); !value.is_null()) (*known)[key] = value;
    (*known)["processes"].push_back(p.name);
  }
  return out;
}

// Returns the launcher's command line; for a session that was started by hand, that of each process.
ordered_json commands(const std::vector<Process>& processes) {
  auto by_hand = ordered_json::object();
  for (const Process& p : processes) {
    if (const std::string launched_by = fact(p, "launched_by"); p.role == "master" && !launched_by.empty())
      return launched_by;
    if (const std::string command = fact(p, "command"); !command.empty()) by_hand[p.name] = command;
  }
  return by_hand.empty() ? ordered_json() : by_hand;
}

ordered_json lines_of(const std::string& text) {
  auto out = ordered_json::array();
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

ordered_json data_of(const Roster& roster) {
  const std::string file = roster.fact("data", "data_file");
  if (file.empty()) return {};
  return {{"file", file},
          {"bytes", number_or_null(roster.fact("data", "data_bytes"))},
          {"hash", text_or_null(roster.fact("data", "data_hash"))},
          {"remarks", lines_of(roster.fact("data", "remarks"))}};
}

ordered_json trajectory_of(const Roster& roster) {
  const std::string name = roster.fact("viewer", "trajectory");
  if (name.empty()) return {};
  return {{"name", name},
          {"file", text_or_null(roster.fact("viewer", "trajectory_file"))},
          {"hash", text_or_null(roster.fact("viewer", "trajectory_hash"))}};
}

// Returns the tasks that the first viewer was given.
ordered_json asked_of(const Roster& roster) {
  ordered_json out;
  for (const char* key : {"duration_s", "frames", "hold_s", "verify_every", "target_fps", "update_rate", "fov_deg"})
    out[key] = number_or_null(roster.fact("viewer", key));
  return out;
}

}  // namespace

ordered_json what_was_done(const About& about, const std::vector<Process>& processes) {
  const Roster roster(processes);
  const auto date = [](int64_t ns) { return ns ? ordered_json(iso_time(ns)) : ordered_json(); };
  ordered_json out{{"id", text_or_null(about.id)},        {"version", text_or_null(about.version)},
                   {"begin", date(about.begin.unix_ns)},  {"begin_monotonic_s", nullptr},
                   {"end", date(about.end_unix_ns)},      {"command", commands(processes)},
                   {"machines", machines(processes)},     {"data", data_of(roster)},
                   {"trajectory", trajectory_of(roster)}, {"asked", asked_of(roster)},
                   {"settings", about.settings}};
  out["label"] = text_or_null(about.label);
  if (about.begin.unix_ns) out["begin_monotonic_s"] = about.begin.monotonic_s;
  return out;
}

}  // namespace telesplat::metrics
