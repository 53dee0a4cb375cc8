// `telesplat ctl ORDER ...`: asks or tells a running session's master.
#include <cstdio>

#include <fmt/format.h>

#include "common/net/master_address.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/control/orders.h"

namespace telesplat::launcher {
namespace {

struct StatusOptions {
  std::string master = "tcp://127.0.0.1:7700";
};

struct OrderOptions {
  Order order;
  std::vector<std::string> words;
  std::string master = "tcp://127.0.0.1:7700";
};

options::Table status_table(StatusOptions& o) {
  return {
      {.flag = "--master", .value = &o.master, .help = "address of the master", .environment = net::kMasterVariable}};
}

options::Table order_table(OrderOptions& o) {
  options::Table out;
  if (!o.order.words.empty()) out.push_back({.flag = "values", .value = &o.words, .help = o.order.words});
  out.push_back(
      {.flag = "--master", .value = &o.master, .help = "address of the master", .environment = net::kMasterVariable});
  return out;
}

int show_status(StatusOptions o, const options::Given&) {
  log::initialise("ctl", "warn");
  ControlClient client(o.master);
  const auto answer = client.ask("status", kPatience_s);
  if (!answer) return tools::complain(answer.error(), 1);
  const auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
  std::printf("%s\n", json.is_object() ? json.dump(2).c_str() : answer->c_str());
  return 0;
}

// A master that refuses was asked for something wrong.
int give_order(OrderOptions o, const options::Given&) {
  log::initialise("ctl", "warn");
  ControlClient client(o.master);
  auto arguments = o.order.read ? o.order.read(o.words, client) : Result<Order::Arguments>(Order::Arguments{});
  if (!arguments) return tools::complain(arguments.error());
  const auto reply = client.order(o.order.name, kPatience_s, *arguments);
  if (!reply) return tools::complain(reply.error(), 1);
  if (!reply->ok) return tools::complain({reply->text});
  std::printf("%s\n", reply->text.c_str());
  return 0;
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
  for (const Order& order : orders()) out.commands.push_back(order_command(order));
  return out;
}

}  // namespace telesplat::launcher
