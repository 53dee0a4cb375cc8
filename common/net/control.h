// Commands to a master (wire::Control), for `telesplat ctl` and health checks.
#pragma once

#include <map>
#include <string>

#include "common/net/socket.h"

namespace telesplat::net {

/// For a DEALER that asks a master: it notices if no process listens.
inline constexpr SocketOptions kControlSocket{
    .high_water_mark = 16, .max_message_bytes = 2 * wire::kMaxControlBytes, .linger_ms = 0, .watch_connecting = true};

/// The user of this program, for others to read: "ada of node7". Sent as the argument "by" of "stop".
std::string this_person();

/// Sends a command over `socket`, a DEALER that is connected to the master at `endpoint`, and waits for its answer,
/// which may be a refusal. Error: it did not answer within `timeout_s`; if the socket has kControlSocket, at once if no
/// process listens or our keys are refused. Drops answers to earlier commands that are there already; a later one would
/// pass for this command's, so after an error the socket must be given up.
Result<wire::ControlReply> reply_of_master(Socket& socket, const std::string& endpoint, const std::string& command,
                                           double timeout_s, const std::map<std::string, std::string>& arguments = {});

/// Returns the text of the answer. A refusal is an error, too.
Result<std::string> ask_master(Socket& socket, const std::string& endpoint, const std::string& command,
                               double timeout_s, const std::map<std::string, std::string>& arguments = {});

/// Returns why no answer can come over a socket that has kControlSocket, in a line that names the master; else empty.
std::string refusal_of_master(const Socket& socket, const std::string& endpoint);

/// Asks over a socket of its own.
Result<std::string> ask_master(const std::string& endpoint, const std::string& command, double timeout_s,
                               const std::map<std::string, std::string>& arguments = {}, const Access& access = {});

}  // namespace telesplat::net
