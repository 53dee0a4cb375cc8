// What the master says of a session: to `telesplat ctl status`, and to the run's record at the end.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

using Json = nlohmann::ordered_json;

Figures sum(const std::map<scene::Pipeline, std::unique_ptr<Plan>>& plans) {
  Figures out;
  for (const auto& [pipeline, plan] : plans) {
    const Figures f = plan->figures();
    out.frames_completed += f.frames_completed;
    out.frames_in_flight += f.frames_in_flight;
    out.released += f.released;
    out.backups += f.backups;
  }
  return out;
}

}  // namespace

std::vector<metrics::Process> MasterCore::processes() const {
  std::vector<metrics::Process> out;
  for (const auto& [id, p] : peers_)
    if (p.hello.role != "ctl") out.push_back(p.process);
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

std::map<std::string, double> MasterCore::counters() const {
  const Figures f = sum(plans_);
  std::map<std::string, double> out{{"leases_expired", double(leases_expired_)},
                                    {"tiles_released", double(f.released)},
                                    {"leases_backup", double(f.backups)},
                                    {"frames_completed", double(f.frames_completed)}};
  for (const auto& [pipeline, plan] : plans_) plan->add_counters(out);
  return out;
}

std::string MasterCore::status_json(double now_s) const {
  const Figures f = sum(plans_);
  Json out{{"epoch", epoch_.value},
           {"frames_completed", f.frames_completed},
           {"frames_in_flight", f.frames_in_flight},
           {"leases_expired", leases_expired_},
           {"tiles_released", f.released},
           {"leases_backup", f.backups},
           {"parameters", Json::object()},
           {"animation", animation()}};
  for (const auto& [name, value] : scene_as_told().parameters) out["parameters"][name] = value;
  plan_->add_status(out);
  out["processes"] = Json::array();
  for (const auto& [id, p] : peers_) {
    if (p.hello.role == "ctl") continue;
    Json e{{"role", p.hello.role},
           {"name", p.hello.name},
           {"pid", p.hello.pid},
           {"alive", !p.gone},
           {"silent_s", std::max(0.0, now_s - p.seen_s)}};
    if (p.hello.role == "sampler") e["leases"] = plan_->leases_of(id);
    for (const auto& [key, value] : p.hello.endpoints) e["endpoints"][key] = value;
    for (const auto& [key, value] : p.hello.facts) e["facts"][key] = value;
    for (const auto& [key, value] : p.process.values) e["values"][key] = value;
    out["processes"].push_back(e);
  }
  // Texts from peers may be any bytes: what is not UTF-8 is shown as U+FFFD.
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace telesplat::master
