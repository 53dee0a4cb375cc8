// One message must not end the session.
#pragma once

#include <exception>
#include <string>

#include "common/net/socket.h"

namespace telesplat::master {

/// Runs handle(), which works on `message`. An exception that escapes it counts and is logged as the message's fault.
void guarded(net::Socket& from, const net::Message& message, auto&& handle) {
  try {
    handle();
  } catch (const std::exception& e) {
    from.reject(message, std::string("handling it failed: ") + e.what());
  }
}

}  // namespace telesplat::master
