// `telesplat ctl ORDER ...`: sends questions and orders to a running session's master.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <optional>
#include <thread>

#include "common/net/service.h"
#include "common/net/session_file.h"
#include "common/options/complain.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/control/orders.h"
#include "tools/telesplat/control/status_text.h"

namespace telesplat::launcher {
namespace {

constexpr std::chrono::milliseconds kLookAtSignals{50};
constexpr int kLooksASecond = 20;

struct StatusOptions {
  SessionChoice session;
  bool json = false, watch = false;
};

struct OrderOptions {
  Order order;
  std::vector<std::string> words;
  SessionChoice session;
};

options::Table status_table(StatusOptions& o) {
  return joined({{.flag = "--json", .value = &o.json, .help = "print everything for programs"},
                 {.flag = "--watch", .value = &o.watch, .help = "again every second, until Ctrl-C or the end"}},
                session_rows(o.session));
}

options::Table order_table(OrderOptions& o) {
  options::Table out;
  if (!o.order.words.empty()) out.push_back({.flag = "values", .value = &o.words, .help = o.order.words});
  return joined(std::move(out), session_rows(o.session));
}

// Error: no answer.
Status print_status(ControlClient& client, const StatusOptions& o) {
  const auto status = client.status(kPatience_s);
  if (!status) return status.error();
  if (o.watch && !o.json) std::printf("\033[H\033[2J");  // from the top of an empty screen
  const std::string text = o.json ? status->dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n"
                                  : status_text(*status, double(std::time(nullptr)));
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
  return ok_status();
}

int show_status(StatusOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code, net::any_role());  // every role may ask for the status
  if (!client) return exit_code;
  if (o.watch) net::install_signal_handlers();
  bool shown = false;
  do {
    if (const Status s = print_status(*client, o); !s) {
      if (!shown || net::stop_requested() || !client->nobody_there()) return complain(s.error(), 1);
      std::printf("the session has ended\n");
      return 0;
    }
    shown = true;
    for (int i = 0; i < kLooksASecond && o.watch && !net::stop_requested(); ++i)
      std::this_thread::sleep_for(kLookAtSignals);
  } while (o.watch && !net::stop_requested());
  return 0;
}

// Prints the status' value of `key`, for an order without words. Returns the exit code.
int print_shown(ControlClient& client, const std::string& key) {
  const auto status = client.status(kPatience_s);
  if (!status) return complain(status.error(), 1);
  const std::string shown = status->value(key, std::string("off"));
  std::printf("%s\n", shown.c_str());
  return 0;
}

// If the master refuses, the order was wrong.
int give_order(OrderOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  if (o.words.empty() && !o.order.shown.empty()) return print_shown(*client, o.order.shown);
  auto arguments = o.order.read ? o.order.read(o.words, *client) : Result<Order::Arguments>(Order::Arguments{});
  if (!arguments) return complain(arguments.error(), client->unanswered() ? 1 : 2);
  return tell_answer(client->order(o.order.name, kPatience_s, *arguments));
}

Command order_command(const Order& order) {
  auto o = std::make_shared<OrderOptions>();
  o->order = order;
  return make_command(order.name, order.help, order_table, give_order, std::move(o));
}

using Json = nlohmann::ordered_json;

constexpr double kListPatience_s = 0.5;  // for each master: all are on this machine

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
  const auto status = client.status(kListPatience_s);
  if (!status) return std::nullopt;
  int out = 0;
  for (const auto& p : array(*status, "processes")) out += text(p, "role") == "viewer" && flag(p, "alive");
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

Command control_command() {
  Command out{.name = "ctl", .help = "ask or tell a running session's master", .table = {}, .run = {}};
  out.commands.push_back(
      make_command("status", "who takes part in the session and what they count", status_table, show_status));
  out.commands.push_back(list_command());
  out.commands.push_back(coupling_command());
  for (Command& command : hands_commands()) out.commands.push_back(std::move(command));
  for (const Order& order : orders()) out.commands.push_back(order_command(order));
  for (Command& command : setting_commands()) out.commands.push_back(std::move(command));
  return out;
}

Command list_command() { return make_command("list", "the sessions of yours that run on this machine", table, list); }

}  // namespace telesplat::launcher
