#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <optional>

#include "common/net/session_file.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/control/commands.h"
#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/control/status_text.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kListPatience_s = 0.5;  // for each master: it is on this machine

struct ListOptions {
  bool json = false;
};

options::Table table(ListOptions& o) {
  return {{.flag = "--json", .value = &o.json, .help = "print everything for programs: a list of sessions"}};
}

// nullopt: the master does not answer.
std::optional<int> viewers_of(const net::RunningSession& session) {
  const auto access = net::Access::open({}, session.keys, net::any_role());
  if (!access) return std::nullopt;
  ControlClient client(session.address, *access);
  const auto answer = client.ask("status", kListPatience_s);
  const auto status = answer ? Json::parse(*answer, nullptr, false) : Json();
  if (!status.is_object()) return std::nullopt;
  int out = 0;
  for (const auto& p : array(status, "processes")) out += text(p, "role") == "viewer" && flag(p, "alive");
  return out;
}

int list(ListOptions o, const options::Given&) {
  log::initialise("ctl", "warn");
  const auto now_s = double(std::time(nullptr));
  Json json = Json::array();
  tools::TextTable table({{"address", false},
                          {"pid"},
                          {"scene", false},
                          {"kind", false},
                          {"by", false},
                          {"since", false},
                          {"viewers"},
                          {"run folder", false}});
  for (const auto& s : net::running_sessions()) {
    const auto viewers = viewers_of(s);
    json.push_back({{"address", s.address},
                    {"pid", s.pid},
                    {"scene", s.scene},
                    {"kind", s.kind},
                    {"started_by", s.started_by},
                    {"started_at", fmt::format("{:%FT%TZ}", fmt::gmtime(std::time_t(s.started_at_s)))},
                    {"viewers", viewers ? Json(*viewers) : Json()},
                    {"run_folder", s.run_folder}});
    table.add({s.address, std::to_string(s.pid), s.scene.empty() ? "not known yet" : tools::shortened(s.scene, 28),
               s.kind, s.started_by, local_time(s.started_at_s, now_s), viewers ? std::to_string(*viewers) : "?",
               s.run_folder});
  }
  if (o.json)
    std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  else if (table.empty())
    std::printf("no session of yours runs on this machine\n");
  else
    std::fputs(table.text().c_str(), stdout);
  return 0;
}

}  // namespace

Command list_command() { return make_command("list", "the sessions of yours that run on this machine", table, list); }

}  // namespace telesplat::launcher
