// The sockets that a viewer receives a session's updates from, by the names of their endpoints.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/net/socket.h"

namespace telesplat::viewer {

/// A socket of this kind to an endpoint of wire::Welcome, as "state".
struct Feed {
  net::Kind kind;
  const char* endpoint;
};

/// Used by one thread.
class Feeds {
 public:
  /// viewer: its name, for logs.
  Feeds(net::Context& context, std::string viewer) : context_(context), viewer_(std::move(viewer)) {}

  /// Connects to where the session says that these are. True: anew, because it is not where it was; what was open is
  /// closed. While the session does not know all of them everything stays as it is.
  bool connect(std::span<const Feed> wanted, const wire::Welcome& session);
  void close() { open_.clear(); }

  bool connected() const { return !open_.empty(); }
  /// Null if it is not connected.
  net::Socket* find(std::string_view endpoint);
  /// Adds all sockets, to wait for.
  void add_to(std::vector<net::Socket*>& sockets);
  /// Messages that could not be used, of the sockets that are open.
  uint64_t rejected() const;

 private:
  struct Open {
    std::string_view endpoint;
    std::string address;
    net::Socket socket;
  };
  net::Context& context_;
  std::string viewer_;
  std::vector<Open> open_;
};

}  // namespace telesplat::viewer
