// Commands to a master (wire::Control): what `telesplat ctl` says, and health checks.
#pragma once

#include <map>
#include <string>

#include "common/net/socket.h"

namespace telesplat::net {

/// Sends a command over `socket`, a DEALER that is connected to the master at `endpoint`, and waits for its answer.
/// Error: the master's refusal, or that it did not answer within `timeout_s`. Answers to earlier commands are dropped.
Result<std::string> ask_master(Socket& socket, const std::string& endpoint, const std::string& command,
                               double timeout_s, const std::map<std::string, std::string>& arguments = {});

/// The same over a socket of its own.
Result<std::string> ask_master(const std::string& endpoint, const std::string& command, double timeout_s,
                               const std::map<std::string, std::string>& arguments = {});

}  // namespace telesplat::net
