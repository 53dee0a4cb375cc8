#include "services/master/master_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/core/log.h"
#include "common/metrics/roster.h"
#include "common/scene/session.h"
#include "services/master/peers/told_tables.h"

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

// Of the first of a role that tells something; of viewers, of the one that records into the folder itself.
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

}  // namespace telesplat::master
