// `telesplat ctl ORDER ...`: asks or tells a running session's master.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <thread>

#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/choice.h"
#include "tools/telesplat/control/commands.h"
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
  const auto answer = client.ask("status", kPatience_s);
  if (!answer) return answer.error();
  const auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
  if (!json.is_object()) return Error{"the master's answer is not a status"};
  if (o.watch && !o.json) std::printf("\033[H\033[2J");  // from the top of an empty screen
  const std::string text = o.json ? json.dump(2, ' ', false, decltype(json)::error_handler_t::replace) + "\n"
                                  : status_text(json, double(std::time(nullptr)));
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
  return ok_status();
}

int show_status(StatusOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code, net::any_role());  // everybody may ask that
  if (!client) return exit_code;
  if (o.watch) net::install_signal_handlers();
  bool shown = false;
  do {
    if (const Status s = print_status(*client, o); !s) {
      if (!shown || net::stop_requested() || !client->nobody_there()) return tools::complain(s.error(), 1);
      std::printf("the session has ended\n");
      return 0;
    }
    shown = true;
    for (int i = 0; i < kLooksASecond && o.watch && !net::stop_requested(); ++i)
      std::this_thread::sleep_for(kLookAtSignals);
  } while (o.watch && !net::stop_requested());
  return 0;
}

// What an order without words asks for. Exit code.
int print_shown(ControlClient& client, const std::string& key) {
  const auto answer = client.ask("status", kPatience_s);
  if (!answer) return tools::complain(answer.error(), 1);
  const auto status = nlohmann::json::parse(*answer, nullptr, false);
  const std::string shown = status.is_object() ? status.value(key, std::string("off")) : "off";
  std::printf("%s\n", shown.c_str());
  return 0;
}

// A master that refuses was asked for something wrong.
int give_order(OrderOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  if (o.words.empty() && !o.order.shown.empty()) return print_shown(*client, o.order.shown);
  auto arguments = o.order.read ? o.order.read(o.words, *client) : Result<Order::Arguments>(Order::Arguments{});
  if (!arguments) return tools::complain(arguments.error(), client->unanswered() ? 1 : 2);
  return tell_answer(client->order(o.order.name, kPatience_s, *arguments));
}

Command order_command(const Order& order) {
  auto o = std::make_shared<OrderOptions>();
  o->order = order;
  return make_command(order.name, order.help, order_table, give_order, std::move(o));
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

}  // namespace telesplat::launcher
