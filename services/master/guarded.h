// One message must not end the session.
#pragma once

#include <exception>
#include <string>

#include "common/net/socket.h"

namespace telesplat::master {

/// Runs handle(), which works on `message`. If an exception escapes, rejects the message: counted and logged.
void guarded(net::Socket& from, const net::Message& message, auto&& handle) {
  try {
    handle();
  } catch (const std::exception& e) {
    from.reject(message, std::string("handling it failed: ") + e.what());
  }
}

}  // namespace telesplat::master
