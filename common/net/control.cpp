#include "common/net/control.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include "common/core/clock.h"
#include "common/net/connections/waiting.h"
#include "common/net/service.h"

namespace telesplat::net {
namespace {

std::string nothing_there(const Socket& socket, const std::string& endpoint) {
  const std::string problem = socket.tunnelled() ? std::string() : host_problem(endpoint);
  return problem.empty() ? "nothing takes connections there" : problem;
}

}  // namespace

std::string this_person() {
  char text[1024];
  passwd entry{}, *found = nullptr;
  const bool known = getpwuid_r(getuid(), &entry, text, sizeof text, &found) == 0 && found;
  return fmt::format("{} of {}", known ? found->pw_name : fmt::format("user {}", getuid()), host_name());
}

std::string refusal_of_master(const Socket& socket, const std::string& endpoint) {
  const auto refusal = socket.refusal();
  return refusal.text.empty() ? std::string() : fmt::format("the master at {} refuses: {}", endpoint, refusal.text);
}

Result<wire::ControlReply> reply_of_master(Socket& socket, const std::string& endpoint, const std::string& command,
                                           double timeout_s, const std::map<std::string, std::string>& arguments) {
  while (socket.receive()) {
  }  // drops answers to earlier commands
  const uint64_t failed_before = socket.failed_connections();
  socket.send(wire::Control{command, arguments});
  for (const double until = monotonic_s() + timeout_s; monotonic_s() < until;) {
    wait_readable({&socket}, 20);
    while (const auto message = socket.receive()) {
      if (message->type != wire::ControlReply::kName) continue;
      if (auto reply = socket.decode<wire::ControlReply>(*message)) return *std::move(reply);
    }
    if (std::string refusal = refusal_of_master(socket, endpoint); !refusal.empty()) return Error{std::move(refusal)};
    if (socket.failed_connections() != failed_before)
      return Error{fmt::format("no master is at {}: {}", endpoint, nothing_there(socket, endpoint))};
  }
  return Error{fmt::format("no answer from a master at {} within {} s{}", endpoint, timeout_s,
                           socket.in_touch() ? fmt::format(": it is no master, is busy, or speaks another version of "
                                                           "the protocol than {}",
                                                           wire::kProtocolVersion)
                                             : "")};
}

Result<std::string> ask_master(Socket& socket, const std::string& endpoint, const std::string& command,
                               double timeout_s, const std::map<std::string, std::string>& arguments) {
  auto reply = reply_of_master(socket, endpoint, command, timeout_s, arguments);
  if (!reply) return reply.error();
  if (!reply->ok) return Error{std::move(reply->text)};
  return std::move(reply->text);
}

Result<std::string> ask_master(const std::string& endpoint, const std::string& command, double timeout_s,
                               const std::map<std::string, std::string>& arguments, const Access& access) {
  Context context(access);
  Socket socket(context, Kind::kDealer, "ctl", kControlSocket);
  if (const Status s = socket.connect(endpoint); !s) return s.error();
  return ask_master(socket, endpoint, command, timeout_s, arguments);
}

}  // namespace telesplat::net
