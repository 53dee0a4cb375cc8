// Answers ZeroMQ's question who may come in (ZAP, RFC 27), on a thread of its own: owners of keys on the allow-list
// whose role may send something at this socket. Private to this library.
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
  /// Binds in `context`, which must outlive it; a context has at most one. Error: the allow-list cannot be read.
  static Result<std::unique_ptr<Doorkeeper>> open(zmq::context_t& context, const Keys& keys);
  ~Doorkeeper();

  /// Visitors that may be in now, as text_of(Visitor), by the newest list that could be read: checked once a second.
  /// Any thread; the same pointer as long as the list has not changed.
  std::shared_ptr<const std::set<std::string>> may_stay() const;

 private:
  struct Impl;
  explicit Doorkeeper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Sender of a message, as the doorkeeper wrote it into ZeroMQ's data about the connection.
struct Visitor {
  Role role = Role::kViewer;
  std::string_view name, key;
};
std::string text_of(const Visitor& visitor);
/// Nothing: `text` does not come from text_of().
std::optional<Visitor> visitor_of(std::string_view text);

/// To be called before `socket` binds: lets in only visitors that the doorkeeper admits to `serves` (SocketOptions).
void guard(zmq::socket_t& socket, const Keys& keys, std::string_view serves);
/// To be called before `socket` connects: shows its own key, and talks only to the server of its keys.
void identify(zmq::socket_t& socket, const Keys& keys);

}  // namespace telesplat::net
