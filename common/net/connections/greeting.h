// Reads the greeting that a ZeroMQ peer sends before it lets anyone in.
#pragma once

#include <string>

#include "common/core/result.h"

namespace telesplat::net {

/// Connects to tcp://HOST:PORT, and reads the security mechanism in its greeting (ZMTP 3, RFC 23): "NULL" or "CURVE".
/// Empty: no ZMTP peer sent one within half a second.
std::string mechanism_at(const std::string& endpoint);

/// Checks that this machine reaches itself at 127.0.0.1. Error: the system's reason why not.
Status check_loopback();

}  // namespace telesplat::net
