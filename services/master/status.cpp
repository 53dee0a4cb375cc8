// The master's report on a session: for `telesplat ctl status`, and for the run's record at the end.
#include <fmt/chrono.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

#include "common/scene/session.h"
#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

using Json = nlohmann::ordered_json;

// Returns a whole number as an integer, as programs expect of counts.
Json number(double value) {
  constexpr double kMostWhole = 9007199254740992.0;  // 2^53: above it doubles skip whole numbers
  if (value == std::floor(value) && std::abs(value) <= kMostWhole) return Json(int64_t(value));
  return Json(value);
}

// Counters of processes, which only grow: they have rates.
constexpr const char* kCounters[] = {"frames", "updates", "bytes_received", "points_received", "tiles_sampled",
                                     "tiles",  "blocks",  "bytes_sent",     "requests",        "volume_frames_complete",
                                     "busy_s"};

// Returns how much each counter grew per second between a process' oldest and newest kept report, by its own clock.
std::map<std::string, double> rates(const std::deque<std::map<std::string, double>>& reports) {
  std::map<std::string, double> out;
  if (reports.size() < 2) return out;
  const auto &first = reports.front(), &last = reports.back();
  const auto from = first.find("reported_s"), to = last.find("reported_s");
  if (from == first.end() || to == last.end() || !(to->second > from->second)) return out;
  for (const char* name : kCounters)
    if (const auto a = first.find(name), b = last.find(name); a != first.end() && b != last.end())
      out[name] = std::max(0.0, (b->second - a->second) / (to->second - from->second));
  return out;
}

// Texts from peers may be any bytes: what is not UTF-8 is shown as U+FFFD.
std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

constexpr size_t kMostBytes = 768u << 10;  // limit of an answer; all but its processes is short
constexpr size_t kMostFactBytes = 4096;    // a path is shorter, a transfer function may be longer

std::string shortened(const std::string& fact) {
  return fact.size() <= kMostFactBytes ? fact : fact.substr(0, kMostFactBytes - 3) + "...";
}

// Adds the orders that the launcher has to answer (docs/protocol.md).
void add_wishes(const Errands& errands, Json& out) {
  for (const auto& [number, wish] : errands.wishes())
    out["wishes"].push_back({{"number", number}, {"command", wish.command}, {"arguments", wish.arguments}});
}

Json told(const net::RunningSession& s) {
  return {{"address", s.address},
          {"pid", s.pid},
          {"scene", s.scene},
          {"kind", s.kind},
          {"started_at", fmt::format("{:%FT%TZ}", fmt::gmtime(std::time_t(s.started_at_s)))},
          {"started_by", s.started_by},
          {"run_folder", s.run_folder},
          {"keys", s.keys}};
}

}  // namespace

std::map<std::string, double> MasterCore::counters() const {
  const Figures f = figures();
  std::map<std::string, double> out{
      {"leases_expired", double(f.expired)},   {"tiles_released", double(f.released)},
      {"leases_backup", double(f.backups)},    {"views_overtaken", double(f.overtaken)},
      {"frames_given_up", double(f.given_up)}, {"frames_completed", double(f.frames_completed)}};
  SwapBarrier::Figures swaps = swaps_;
  for (const auto& [name, wall] : walls_) swaps += wall.figures();
  const LimitsHit hit = gate_.hit();
  out["limits.views_coarser"] = double(hit.views_coarser);
  out["limits.hellos_refused"] = double(hit.hellos_refused);
  out["limits.messages_refused"] = double(hit.messages_refused);
  if (swaps.frames > 0) out["swaps"] = double(swaps.frames), out["swaps_incomplete"] = double(swaps.incomplete);
  if (const auto forgotten = peers_.departed().forgotten(); forgotten > 0)
    out["processes_forgotten"] = double(forgotten);
  scene_.add_counters(out);
  return out;
}

LiveSnapshot MasterCore::live_snapshot() const {
  const Figures f = figures();
  LiveSnapshot out{.version = {},
                   .scene = session_.scene,
                   .kind = session_.kind,
                   .started_at_s = session_.started_at_s,
                   .epoch = double(scene_.epoch().value),
                   .views_completed = double(f.frames_completed),
                   .views_in_flight = double(f.frames_in_flight),
                   .views_waiting = double(plan().views().views_waiting()),
                   .leases_expired = double(f.expired),
                   .leases_backup = double(f.backups),
                   .views_overtaken = double(f.overtaken),
                   .frames_given_up = double(f.given_up),
                   .tiles_released = double(f.released),
                   .processes = {}};
  for (const auto& [id, p] : peers_) {
    if (p.hello.role == "ctl") continue;
    LiveProcess& e = out.processes.emplace_back();
    e.role = p.hello.role;
    e.name = p.hello.name;
    e.alive = !p.gone;
    if (p.hello.role == "sampler") e.leases = double(plan().leases_of(id));
    e.values = p.process.values;
    for (const auto& [key, value] : plan().link_of(p.hello.instance)) e.values[key] = value;
    e.rates = rates(p.reports);
  }
  return out;
}

Json MasterCore::process_json(const std::string& id, const Peer& p, double now_s, bool all) const {
  Json e{{"role", p.hello.role},
         {"name", p.hello.name},
         {"pid", p.hello.pid},
         {"alive", !p.gone},
         {"silent_s", std::max(0.0, now_s - p.seen_s)}};
  if (p.hello.role == "sampler") e["leases"] = plan().leases_of(id);
  if (const auto stuck_s = plan().stuck_s(id, now_s)) e["delivers_nothing_s"] = *stuck_s;
  for (const auto& [key, value] : p.hello.endpoints) e["endpoints"][key] = value;
  for (const auto& [key, value] : p.hello.facts)
    if (key != metrics::kRecordFact) e["facts"][key] = all ? value : shortened(value);
  for (const auto& [key, value] : p.process.values) e["values"][key] = number(value);
  for (const auto& [key, value] : plan().link_of(p.hello.instance)) e["values"][key] = number(value);
  e["rates"] = Json(rates(p.reports));
  return e;
}

std::string MasterCore::status_json(double now_s, bool all) const {
  const Figures f = figures();
  const LimitsHit hit = gate_.hit();
  // Adds the counts of all processes to the master's own.
  const auto of_all = [&](uint64_t own, const char* key) {
    double sum = double(own);
    const auto add = [&](const metrics::Process& p) {
      if (const double n = scene::value_or(p.values, key, 0.0); n > 0 && n < 1e15) sum += n;
    };
    for (const auto& p : peers_.departed().kept()) add(p);
    for (const auto& [id, p] : peers_) add(p.process);
    return number(sum);
  };
  Json out{{"session", told(session_)},
           {"lacks", peers_.lacks()},
           {"messages_rejected", door_.messages_rejected},
           {"keys_refused", door_.keys_refused},
           {"epoch", scene_.epoch().value},
           {"frames_completed", f.frames_completed},
           {"frames_in_flight", f.frames_in_flight},
           {"views_waiting", plan().views().views_waiting()},
           {"leases_expired", f.expired},
           {"tiles_released", f.released},
           {"leases_backup", f.backups},
           {"views_overtaken", f.overtaken},
           {"frames_given_up", f.given_up},
           {"limits",
            {{"max_sampling_pixels", options_.limits.max_sampling_pixels},
             {"max_peers", options_.limits.max_peers},
             {"max_messages", options_.limits.max_messages},
             {"max_connections", door_.max_connections},
             {"queue_limit_mb", number(door_.queue_limit_mb)},
             {"views_coarser", hit.views_coarser},
             {"hellos_refused", hit.hellos_refused},
             {"messages_refused", of_all(hit.messages_refused, "messages_refused")},
             {"connections_refused", of_all(door_.connections_refused, "connections_refused")},
             {"queue_refused", of_all(door_.queue_refused, "queue_refused")}}},
           {"parameters", Json::object()},
           {"animation", animation()}};
  for (const auto& [name, value] : scene_.describe().parameters) out["parameters"][name] = number(value);
  if (!scene_.clip_order().empty()) out["clip"] = scene_.clip_order();
  if (const auto failed = record_.losses().failed; !failed.empty()) out["record_failed"] = failed;
  add_wishes(errands_, out);
  plan().add_status(out);
  out["departed"] = peers_.departed().count();
  // Processes that are here come first: an answer is one message, and what is too much is left out.
  out["processes"] = Json::array();
  size_t bytes = dumped(out).size(), left_out = 0;
  for (const bool gone : {false, true})
    for (const auto& [id, p] : peers_) {
      if (p.hello.role == "ctl" || p.gone != gone) continue;
      Json e = process_json(id, p, now_s, all);
      bytes += left_out > 0 ? 0 : dumped(e).size() + 1;
      left_out += bytes > kMostBytes;
      if (bytes <= kMostBytes) out["processes"].push_back(std::move(e));
    }
  if (left_out > 0) out["processes_left_out"] = left_out;
  return dumped(out);
}

}  // namespace telesplat::master
