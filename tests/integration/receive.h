// Waits for messages of a socket.
#pragma once

#include <utility>
#include <vector>

#include "common/core/clock.h"
#include "common/net/socket.h"
#include "tests/support/patience.h"

namespace telesplat::test {

/// Receives until `done` holds; messages go to `got`. False: it did not hold within the deadline.
template <class Done>
bool receive_until(net::Socket& socket, Done done, std::vector<net::Message>* got = nullptr,
                   double deadline_s = patient(20)) {
  for (const double until = monotonic_s() + deadline_s; monotonic_s() < until;) {
    while (auto m = socket.receive())
      if (got) got->push_back(std::move(*m));
    if (done()) return true;
    net::wait_readable({&socket}, 5);
  }
  return false;
}

}  // namespace telesplat::test
