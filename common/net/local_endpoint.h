// Which endpoints of ZeroMQ stay on this machine.
#pragma once

#include <string_view>

namespace telesplat::net {

inline bool is_local(std::string_view endpoint) {
  for (const char* prefix : {"ipc://", "inproc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"})
    if (endpoint.starts_with(prefix)) return true;
  return false;
}

}  // namespace telesplat::net
