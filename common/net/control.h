// Commands to a master (wire::Control): what `telesplat ctl` says, and health checks.
#pragma once

#include <map>
#include <string>

#include "common/net/socket.h"

namespace telesplat::net {

/// Of a DEALER that asks a master: it knows when nobody is there.
inline constexpr SocketOptions kControlSocket{
    .high_water_mark = 16, .max_message_bytes = 2 * wire::kMaxControlBytes, .linger_ms = 0, .watch_connecting = true};

/// Who runs this program, for others: "ada of node7". Told as the argument "by" of "stop".
std::string this_person();

/// Sends a command over `socket`, a DEALER that is connected to the master at `endpoint`, and waits for its answer,
/// which may be a refusal. Error: it did not answer within `timeout_s`; if the socket has kControlSocket, at once where
/// nothing takes connections, or our keys are not taken. Answers to earlier commands that are there by then are
/// dropped; one that comes later would be taken for this one's, so after an error the socket is to be given up.
Result<wire::ControlReply> reply_of_master(Socket& socket, const std::string& endpoint, const std::string& command,
                                           double timeout_s, const std::map<std::string, std::string>& arguments = {});

/// The text of the answer. Error: a refusal too.
Result<std::string> ask_master(Socket& socket, const std::string& endpoint, const std::string& command,
                               double timeout_s, const std::map<std::string, std::string>& arguments = {});

/// Why no answer can come over a socket that has kControlSocket: empty, or a line that names the master.
std::string refusal_of_master(const Socket& socket, const std::string& endpoint);

/// The same over a socket of its own.
Result<std::string> ask_master(const std::string& endpoint, const std::string& command, double timeout_s,
                               const std::map<std::string, std::string>& arguments = {}, const Access& access = {});

}  // namespace telesplat::net
