// The public keys that are let in, as the file allowed.toml of a folder of keys lists them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/net/keys/roles.h"

namespace telesplat::net {

/// A key that is let in.
struct Allowed {
  std::string name;  ///< of its owner: a role's, or a person's
  Role role = Role::kViewer;
  std::string key;  ///< public
  bool operator==(const Allowed&) const = default;
};

class AllowList {
 public:
  static constexpr size_t kMostBytes = 1 << 20, kMost = 4096;

  /// Error: no TOML; an entry without name, role or key, or with one that is none; a name or a key twice; too many.
  static Result<AllowList> parse(std::string_view text);
  /// As parse() takes it.
  std::string text() const;

  const std::vector<Allowed>& entries() const { return entries_; }
  /// Null: nobody is called so, or has this public key.
  const Allowed* named(std::string_view name) const;
  const Allowed* of_key(std::string_view key) const;

  /// Error: the name or the key is there already, or there are too many.
  Status add(Allowed entry);
  /// False: nobody is called so.
  bool remove(std::string_view name);

 private:
  std::vector<Allowed> entries_;
};

/// Empty if it can be the name of a key, else what is wrong with it.
std::string complain_about_name(std::string_view name);

}  // namespace telesplat::net
