#include "tools/telesplat/control/client.h"

#include <utility>

#include "common/net/control.h"

namespace telesplat::launcher {

ControlClient::ControlClient(const std::string& master_endpoint, const net::Access& access)
    : endpoint_(master_endpoint), context_(access), socket_(context_, net::Kind::kDealer, "ctl", net::kControlSocket) {}

// A connection over which nothing is said counts at the master as a message that it rejected.
void ControlClient::connect() {
  if (std::exchange(connected_, true)) return;
  if (const Status s = socket_.connect(endpoint_); !s) log::error("{}", s.error().text);
}

Result<std::string> ControlClient::ask(const std::string& command, double timeout_s,
                                       const std::map<std::string, std::string>& arguments) {
  auto reply = order(command, timeout_s, arguments);
  if (!reply) return reply.error();
  if (!reply->ok) return Error{std::move(reply->text)};
  return std::move(reply->text);
}

Result<wire::ControlReply> ControlClient::order(const std::string& command, double timeout_s,
                                                const std::map<std::string, std::string>& arguments) {
  connect();
  auto reply = net::reply_of_master(socket_, endpoint_, command, timeout_s, arguments);
  unanswered_ = !reply.ok();
  if (reply) failed_before_ = socket_.failed_connections();
  return reply;
}

void ControlClient::request_status() {
  connect();
  socket_.send(wire::Control{"status", {}});
}

std::optional<nlohmann::json> ControlClient::poll_status() {
  std::optional<nlohmann::json> out;
  while (const auto message = socket_.receive()) {
    if (message->type != wire::ControlReply::kName) continue;
    const auto reply = socket_.decode<wire::ControlReply>(*message);
    if (!reply || !reply->ok) continue;
    auto json = nlohmann::json::parse(reply->text, nullptr, false);
    if (!json.is_object()) continue;
    out = std::move(json);
    failed_before_ = socket_.failed_connections();
  }
  return out;
}

}  // namespace telesplat::launcher
