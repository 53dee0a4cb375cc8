#include "tools/telesplat/control/client.h"

#include <utility>

#include "common/core/utf8.h"
#include "common/net/control.h"

namespace telesplat::launcher {

struct ControlClient::Line {
  explicit Line(const net::Access& access) : context(access) {}
  net::Context context;
  net::Socket socket{context, net::Kind::kDealer, "ctl", net::kControlSocket};
  uint64_t failed_before = 0;  // attempts to connect, by the last answer
  uint64_t due = 0;            // answers to request_status()
};

ControlClient::ControlClient(const std::string& master_endpoint, const net::Access& access)
    : endpoint_(master_endpoint), access_(access) {}
ControlClient::~ControlClient() = default;

// A connection over which nothing is said counts at the master as a message that it rejected.
ControlClient::Line& ControlClient::line() {
  if (line_) return *line_;
  line_ = std::make_unique<Line>(access_);
  if (const Status s = line_->socket.connect(endpoint_); !s) log::error("{}", s.error().text);
  return *line_;
}

bool ControlClient::nobody_there() const {
  return nobody_there_ || (line_ && line_->socket.failed_connections() > line_->failed_before);
}

std::string ControlClient::refusal() const {
  return line_ ? net::refusal_of_master(line_->socket, endpoint_) : std::string();
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
  if (line_ && line_->due > 0) line_.reset();
  Line& to = line();
  auto reply = net::reply_of_master(to.socket, endpoint_, command, timeout_s, arguments);
  unanswered_ = !reply.ok();
  if (reply) {
    reply->text = printable_lines(reply->text);  // whoever said it, it may come to a terminal
    to.failed_before = to.socket.failed_connections();
    nobody_there_ = false;
  } else {
    nobody_there_ = nobody_there();
    line_.reset();
  }
  return reply;
}

void ControlClient::request_status() {
  if (line().socket.send(wire::Control{"status", {}})) ++line_->due;
}

void ControlClient::tell(const std::string& command, const std::map<std::string, std::string>& arguments) {
  if (line().socket.send(wire::Control{command, arguments})) ++line_->due;
}

std::optional<nlohmann::json> ControlClient::poll_status() {
  std::optional<nlohmann::json> out;
  if (!line_) return out;
  while (const auto message = line_->socket.receive()) {
    if (message->type != wire::ControlReply::kName) continue;
    if (line_->due > 0) --line_->due;
    const auto reply = line_->socket.decode<wire::ControlReply>(*message);
    if (!reply || !reply->ok) continue;
    auto json = nlohmann::json::parse(reply->text, nullptr, false);
    if (!json.is_object()) continue;
    out = std::move(json);
    line_->failed_before = line_->socket.failed_connections();
    nobody_there_ = false;
  }
  return out;
}

}  // namespace telesplat::launcher
