// Makes and changes a folder of keys, for `telesplat keys` and for throw-away keys of a run.
#pragma once

#include <string>
#include <vector>

#include "common/core/descriptor.h"
#include "common/core/result.h"
#include "common/net/keys/allow_list.h"
#include "common/net/runtime_folder.h"

namespace telesplat::net {

/// A folder of keys that is being changed; it is locked, so another process that wants to change it waits.
class KeyMaker {
 public:
  /// Makes the folder, for this user alone, if it does not exist. Error: it cannot be made, is another user's, others
  /// may look into it, it holds other files, or its files cannot be read.
  static Result<KeyMaker> open(const std::string& folder);
  KeyMaker(KeyMaker&& other) noexcept = default;
  KeyMaker& operator=(KeyMaker&&) = delete;

  /// Makes the server's key and one of each role, those that are missing. Returns the names of the keys that were made.
  Result<std::vector<std::string>> make_missing();
  /// Makes a key for a person. Error: the name is not valid or is taken, or the role is neither viewer nor operator.
  Status add_person(const std::string& name, Role role);
  /// Takes a key off the allow-list and removes its file. Error: no such key; the server's cannot be revoked.
  Status revoke(const std::string& name);

  const AllowList& allowed() const { return allowed_; }

 private:
  KeyMaker(RuntimeFolder folder, Descriptor lock) : folder_(std::move(folder)), lock_(std::move(lock)) {}
  Status make(const std::string& name, Role role);

  RuntimeFolder folder_;
  Descriptor lock_;
  AllowList allowed_;
};

/// The files that a machine needs. name: "master", a role, or a person of the allow-list. Error: the list has no such
/// name.
Result<std::vector<std::string>> files_for(const AllowList& allowed, const std::string& name);
/// Copies those files into a new folder. Error: the folder exists already, or a file is missing.
Status bundle(const std::string& folder, const AllowList& allowed, const std::string& name, const std::string& out);

}  // namespace telesplat::net
