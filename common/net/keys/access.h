// The proxies and keys with which a process connects to others, and lets others in.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/net/keys/key_files.h"

namespace telesplat::net {

// The proxies through which a process connects to others: for a simulated link, or the way out of a closed network.

/// SOCKS5 proxies, HOST:PORT, by the role of the server; "": for all other roles. Empty: the process connects to no
/// server through a proxy.
class Via {
 public:
  /// Reads texts "HOST:PORT" or "ROLE=HOST:PORT". Error: names the text that is neither.
  static Result<Via> parse(const std::vector<std::string>& texts);

  /// The proxy toward this role; empty: none.
  std::string proxy(const std::string& role) const;

 private:
  std::map<std::string, std::string> proxies_;
};

/// In place of a folder of keys: run without keys.
inline constexpr const char* kNoKeys = "none";

class Access {
 public:
  /// Without keys: nothing is encrypted, and no peer is identified.
  Access(Via via = {}) : via_(std::move(via)) {}  // NOLINT: implicit on purpose
  Access(Via via, Keys keys) : via_(std::move(via)), keys_(std::make_shared<const Keys>(std::move(keys))) {}

  /// folder: of keys; empty or kNoKeys: without keys. roles, binds: as read_keys() takes them. Error: a text that
  /// begins with --keys.
  static Result<Access> open(Via via, const std::string& folder, const std::vector<Role>& roles, bool binds = false);

  const Via& via() const { return via_; }
  /// Allows connections in clear, which lack keys, to other machines without a warning.
  void allow_clear() { clear_allowed_ = true; }
  bool clear_allowed() const { return clear_allowed_; }
  /// Null: without keys.
  const Keys* keys() const { return keys_.get(); }

 private:
  Via via_;
  std::shared_ptr<const Keys> keys_;
  bool clear_allowed_ = false;
};

/// Roles whose keys a program may use to ask or command a master, the preferred one first: `telesplat ctl`, a panel.
inline std::vector<Role> asking_roles() { return {Role::kOperator, Role::kViewer}; }
/// The same for health checks, which run wherever a service runs.
inline std::vector<Role> any_role() {
  return {Role::kOperator, Role::kViewer, Role::kSampler, Role::kPacker, Role::kData, Role::kServer};
}

}  // namespace telesplat::net
