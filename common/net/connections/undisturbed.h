// Calls of ZeroMQ while signals come. Private to this library.
#pragma once

#include <cerrno>
#include <zmq.hpp>

namespace telesplat::net {

/// A call of ZeroMQ that a signal may interrupt, until it is done: given up between two parts of a message it would
/// tear the message. It does not wait.
template <class Call>
auto undisturbed(const Call& call) {
  for (;;) {
    try {
      return call();
    } catch (const zmq::error_t& e) {
      if (e.num() != EINTR) throw;
    }
  }
}

}  // namespace telesplat::net
