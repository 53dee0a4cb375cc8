// Which endpoints of ZeroMQ stay on this machine.
#pragma once

#include <string_view>

namespace telesplat::net {

/// ipc, inproc, and tcp on a loopback address or localhost. Names that only begin like one are none.
bool is_local(std::string_view endpoint);

}  // namespace telesplat::net
