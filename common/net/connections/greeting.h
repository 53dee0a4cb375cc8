// What a peer says of itself before anybody is let in.
#pragma once

#include <string>

#include "common/core/result.h"

namespace telesplat::net {

/// Connects to tcp://HOST:PORT, and reads which security mechanism its greeting names (ZMTP 3, RFC 23): "NULL" or
/// "CURVE". Empty: no peer that speaks so names one within half a second.
std::string mechanism_at(const std::string& endpoint);

/// Whether this machine reaches itself at 127.0.0.1. Error: why not, in the system's words.
Status check_loopback();

}  // namespace telesplat::net
