// How a process reaches others and is reached: through which proxies, and with which keys.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/net/keys/key_files.h"

namespace telesplat::net {

// The proxies through which a process connects to others: a simulated link, or a real way out of a closed network.

/// SOCKS5 proxies, HOST:PORT, by the role of who is connected to; "": of all others. A process that connects to nothing
/// through a proxy has an empty one.
class Via {
 public:
  /// Of texts "HOST:PORT" or "ROLE=HOST:PORT". Error: which one is neither.
  static Result<Via> parse(const std::vector<std::string>& texts);

  /// The proxy toward this role; empty: none.
  std::string proxy(const std::string& role) const;

 private:
  std::map<std::string, std::string> proxies_;
};

/// In place of a folder of keys: there shall be none.
inline constexpr const char* kNoKeys = "none";

class Access {
 public:
  /// Without keys: nothing is encrypted, and nobody asks who it is.
  Access(Via via = {}) : via_(std::move(via)) {}  // NOLINT: implicit on purpose
  Access(Via via, Keys keys) : via_(std::move(via)), keys_(std::make_shared<const Keys>(std::move(keys))) {}

  /// folder: of keys; empty or kNoKeys: without keys. roles, binds: as read_keys() takes them. Error: begins with
  /// --keys.
  static Result<Access> open(Via via, const std::string& folder, const std::vector<Role>& roles, bool binds = false);

  const Via& via() const { return via_; }
  /// Without keys, others than this machine are spoken to in clear; that is warned of unless it is said to be wanted.
  void allow_clear() { clear_allowed_ = true; }
  bool clear_allowed() const { return clear_allowed_; }
  /// Null: none.
  const Keys* keys() const { return keys_.get(); }

 private:
  Via via_;
  std::shared_ptr<const Keys> keys_;
  bool clear_allowed_ = false;
};

/// Whose keys programs take that only ask or tell a master, the most wanted first: `telesplat ctl`, a window's panel.
inline std::vector<Role> asking_roles() { return {Role::kOperator, Role::kViewer}; }
/// And health checks, which run wherever a service runs.
inline std::vector<Role> any_role() {
  return {Role::kOperator, Role::kViewer, Role::kSampler, Role::kPacker, Role::kData, Role::kServer};
}

}  // namespace telesplat::net
