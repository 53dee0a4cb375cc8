#include "common/net/control.h"

#include <fmt/format.h>

#include "common/core/clock.h"

namespace telesplat::net {

Result<std::string> ask_master(Socket& socket, const std::string& endpoint, const std::string& command,
                               double timeout_s, const std::map<std::string, std::string>& arguments) {
  while (socket.receive()) {
  }  // answers to what was asked before
  socket.send(wire::Control{command, arguments});
  for (const double until = monotonic_s() + timeout_s; monotonic_s() < until;) {
    wait_readable({&socket}, 20);
    while (const auto message = socket.receive()) {
      if (message->type != wire::ControlReply::kName) continue;
      const auto reply = socket.decode<wire::ControlReply>(*message);
      if (!reply) continue;
      if (!reply->ok) return Error{reply->text};
      return reply->text;
    }
  }
  return Error{fmt::format("no answer from a master at {} within {} s", endpoint, timeout_s)};
}

Result<std::string> ask_master(const std::string& endpoint, const std::string& command, double timeout_s,
                               const std::map<std::string, std::string>& arguments) {
  Context context;
  Socket socket(context, Kind::kDealer, "ctl",
                {.high_water_mark = 16, .max_message_bytes = 2 * wire::kMaxControlBytes});
  if (const Status s = socket.connect(endpoint); !s) return s.error();
  return ask_master(socket, endpoint, command, timeout_s, arguments);
}

}  // namespace telesplat::net
