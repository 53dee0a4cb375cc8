// Routing of received messages to handlers by type.
#pragma once

#include "common/net/socket.h"

namespace telesplat::net {

/// Decodes `message` as the one of M... with its name and calls handler(decoded). The socket counts and logs other
/// types, and messages that do not decode. Returns true if a handler was called.
template <class... M>
bool dispatch(Socket& socket, const Message& message, auto&& handler) {
  bool called = false;
  const auto try_one = [&]<class T>(std::type_identity<T>) {
    if (message.type != T::kName) return false;
    if (auto decoded = socket.decode<T>(message)) {
      handler(*decoded);
      called = true;
    }
    return true;
  };
  if (!(try_one(std::type_identity<M>{}) || ...)) socket.reject(message, "its type is not expected here");
  return called;
}

}  // namespace telesplat::net
