// Makes and changes a folder of keys: `telesplat keys`, and throw-away keys of a run.
#pragma once

#include <string>
#include <vector>

#include "common/core/descriptor.h"
#include "common/core/result.h"
#include "common/net/keys/allow_list.h"
#include "common/net/runtime_folder.h"

namespace telesplat::net {

/// A folder of keys that is being changed; another process that wants to waits.
class KeyMaker {
 public:
  /// Makes the folder, for this user alone, if it is not there. Error: it cannot be made, is another's, others may look
  /// into it, it holds something else, or what it holds cannot be read.
  static Result<KeyMaker> open(const std::string& folder);
  KeyMaker(KeyMaker&& other) noexcept = default;
  KeyMaker& operator=(KeyMaker&&) = delete;

  /// The server's key and one of each role, as far as they are not there. Returns the names of those that were made.
  Result<std::vector<std::string>> make_missing();
  /// A key for a person. Error: the name cannot be one or is taken, or the role is none for persons (viewer, operator).
  Status add_person(const std::string& name, Role role);
  /// Takes a key off the allow-list and removes its file. Error: there is none; the server's cannot be revoked.
  Status revoke(const std::string& name);

  const AllowList& allowed() const { return allowed_; }

 private:
  KeyMaker(RuntimeFolder folder, Descriptor lock) : folder_(std::move(folder)), lock_(std::move(lock)) {}
  Status make(const std::string& name, Role role);

  RuntimeFolder folder_;
  Descriptor lock_;
  AllowList allowed_;
};

/// The files that a machine of `name` needs: of "master", a role, or a person of the allow-list. Error: nobody is
/// called so.
Result<std::vector<std::string>> files_for(const AllowList& allowed, const std::string& name);
/// Copies them into a new folder. Error: the folder is there already, or a file is missing.
Status bundle(const std::string& folder, const AllowList& allowed, const std::string& name, const std::string& out);

}  // namespace telesplat::net
