// Answers ZeroMQ's question who may come in (ZAP, RFC 27), on a thread of its own: whose key is on the allow-list and
// has a role that is something at this socket. Private to this library.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/net/keys/roles.h"

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

namespace telesplat::net {

struct Keys;

class Doorkeeper {
 public:
  /// Binds in `context`, which must outlive it; there is one in a context. Error: the allow-list cannot be read.
  static Result<std::unique_ptr<Doorkeeper>> open(zmq::context_t& context, const Keys& keys);
  ~Doorkeeper();

  /// Who may be in now, as text_of(Visitor), by the newest list that could be read: it is looked at once a second. Any
  /// thread; the same pointer as long as the list has not changed.
  std::shared_ptr<const std::set<std::string>> may_stay() const;

 private:
  struct Impl;
  explicit Doorkeeper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Who sent a message, as the doorkeeper wrote it into what ZeroMQ knows of the connection.
struct Visitor {
  Role role = Role::kViewer;
  std::string_view name, key;
};
std::string text_of(const Visitor& visitor);
/// Nothing: it is no such text.
std::optional<Visitor> visitor_of(std::string_view text);

/// Before it binds: lets in whom the doorkeeper lets in at `serves` (SocketOptions::serves).
void guard(zmq::socket_t& socket, const Keys& keys, std::string_view serves);
/// Before it connects: says who it is, and talks to the server of its keys alone.
void identify(zmq::socket_t& socket, const Keys& keys);

}  // namespace telesplat::net
