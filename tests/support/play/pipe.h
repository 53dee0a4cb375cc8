// Feeds code that reads from a socket, without a network.
#pragma once

#include <fmt/format.h>

#include "common/net/socket.h"

namespace telesplat::test {

/// A message sent into `in` can be received from `out` at once, in the same thread.
struct Pipe {
  explicit Pipe(net::Context& context)
      : in(context, net::Kind::kPush, "play"),
        out(context, net::Kind::kPull, "play", {.max_message_bytes = wire::kMaxBulkBytes}) {
    static int number = 0;
    const std::string endpoint = fmt::format("inproc://play-{}", ++number);
    CHECK(out.bind(endpoint).ok() && in.connect(endpoint).ok());
  }
  /// Removes messages of an earlier play.
  void empty() {
    while (out.receive()) {
    }
  }
  net::Socket in, out;
};

}  // namespace telesplat::test
