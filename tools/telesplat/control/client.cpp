#include "tools/telesplat/control/client.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "common/core/utf8.h"
#include "common/net/control.h"
#include "common/net/master_address.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "tools/telesplat/control/json_fields.h"

namespace telesplat::launcher {

struct ControlClient::Line {
  explicit Line(const net::Access& access) : context(access) {}
  net::Context context;
  net::Socket socket{context, net::Kind::kDealer, "ctl", net::kControlSocket};
  uint64_t failed_before = 0;  // attempts to connect until the last answer
  uint64_t due = 0;            // answers to request_status() that are still to come
};

ControlClient::ControlClient(const std::string& master_endpoint, const net::Access& access)
    : endpoint_(master_endpoint), access_(access) {}
ControlClient::~ControlClient() = default;

// Connects on first use; callers send a message at once: the master counts a silent connection as a rejected message.
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

Result<nlohmann::ordered_json> ControlClient::status(double timeout_s) {
  const auto answer = ask("status", timeout_s);
  if (!answer) return answer.error();
  auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
  if (!json.is_object()) return Error{"the master's answer is not a status"};
  return json;
}

Result<wire::ControlReply> ControlClient::order(const std::string& command, double timeout_s,
                                                const std::map<std::string, std::string>& arguments) {
  if (line_ && line_->due > 0) line_.reset();
  Line& to = line();
  auto reply = net::reply_of_master(to.socket, endpoint_, command, timeout_s, arguments);
  unanswered_ = !reply.ok();
  if (reply) {
    reply->text = printable_lines(reply->text);  // the text may have any source, and may go to a terminal
    to.failed_before = to.socket.failed_connections();
    nobody_there_ = false;
  } else {
    nobody_there_ = nobody_there();
    line_.reset();
  }
  return reply;
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

std::vector<Wish> wishes_of(const nlohmann::json& status) {
  using Json = nlohmann::ordered_json;
  const Json told = status;
  const Json* session = field(told, "session");
  std::vector<Wish> out;
  for (const Json& w : array(told, "wishes")) {
    const Json* arguments = field(w, "arguments");
    Wish wish{count(w, "number"), session ? count(*session, "pid") : 0, text(w, "command"),
              arguments ? text(*arguments, "value") : std::string()};
    if (wish.number > 0 && !wish.order.empty()) out.push_back(std::move(wish));
  }
  return out;
}

options::Table session_rows(SessionChoice& c) {
  return {{.flag = "--master",
           .value = &c.master,
           .help = "address of the session's master; default: the one session of yours that runs on this machine",
           .environment = net::kMasterVariable},
          {.flag = "--session",
           .value = &c.session,
           .help = "of several sessions on this machine: its PID, scene or run folder, as telesplat ctl list tells"},
          net::keys_row(c.keys)};
}

std::unique_ptr<ControlClient> reach(const SessionChoice& c, const options::Given& given, int& exit_code,
                                     const std::vector<net::Role>& roles) {
  const bool is_told = std::find(given.begin(), given.end(), "--master") != given.end();
  const std::string environment = net::master_from_environment();
  if (!c.session.empty() && is_told && c.master != environment) {
    exit_code = complain({"--master and --session both say which session is meant: give one of them"});
    return nullptr;
  }
  const auto search = net::find_master(c.session.empty() ? c.master : std::string(), c.session);
  if (search.address.empty()) {
    exit_code = complain({search.problem}, search.exit_code());
    return nullptr;
  }
  const auto access = net::Access::open({}, c.keys.empty() ? search.keys : c.keys, roles);
  if (!access) {
    exit_code = complain(access.error());
    return nullptr;
  }
  return std::make_unique<ControlClient>(search.address, *access);
}

int tell_answer(const Result<wire::ControlReply>& reply, const std::string& done) {
  if (!reply) return complain(reply.error(), 1);
  if (!reply->ok) return complain({reply->text});
  std::printf("%s\n", reply->text == "{}" && !done.empty() ? done.c_str() : reply->text.c_str());
  return 0;
}

}  // namespace telesplat::launcher
