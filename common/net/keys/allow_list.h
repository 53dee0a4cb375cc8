// Public keys that are let in, as listed in the file allowed.toml of a folder of keys.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/net/keys/roles.h"

namespace telesplat::net {

/// A key that is let in.
struct Allowed {
  std::string name;  ///< owner of the key: a role's name, or a person's
  Role role = Role::kViewer;
  std::string key;  ///< public
  bool operator==(const Allowed&) const = default;
};

class AllowList {
 public:
  static constexpr size_t kMostBytes = 1 << 20, kMost = 4096;

  /// Error: no TOML; an entry with a missing or invalid name, role or key; a name or a key twice; too many entries.
  static Result<AllowList> parse(std::string_view text);
  /// TOML that parse() reads.
  std::string text() const;

  const std::vector<Allowed>& entries() const { return entries_; }
  /// Null: no entry has this name, or this public key.
  const Allowed* named(std::string_view name) const;
  const Allowed* of_key(std::string_view key) const;

  /// Error: the name or the key is there already, or there are too many.
  Status add(Allowed entry);
  /// False: no entry has this name.
  bool remove(std::string_view name);

 private:
  std::vector<Allowed> entries_;
};

/// Returns what is wrong with a name for a key; empty: it is valid.
std::string complain_about_name(std::string_view name);

}  // namespace telesplat::net
