// A session's master leaves a file in the user's runtime folder while it runs, so that `telesplat ctl` and others of
// this user find it on this machine without being told an address.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/net/runtime_folder.h"

namespace telesplat::net {

/// What a session's file tells.
struct RunningSession {
  std::string address;      ///< the master's, as processes of this machine reach it
  uint64_t pid = 0;         ///< the master's
  std::string scene, kind;  ///< empty: not known yet
  std::string run_folder;   ///< absolute; empty: it keeps no record
  double started_at_s = 0;  ///< wall clock, seconds since 1970
  std::string started_by;   ///< "run", "view", "bench"; "hand": a person started the master itself
  std::string keys;         ///< folder of its keys, absolute; empty: it runs without
  bool operator==(const RunningSession&) const = default;
};

/// The file of a session of this process; gone when the object is.
class SessionFile {
 public:
  /// session.pid is this process. Error: nothing can be written; the session runs all the same, but is not found.
  static Result<SessionFile> publish(const RunningSession& session);
  ~SessionFile();
  SessionFile(SessionFile&& other) noexcept
      : folder_(std::move(other.folder_)), name_(std::exchange(other.name_, {})) {}
  SessionFile& operator=(SessionFile&&) = delete;

  /// More is known.
  Status update(const RunningSession& session) const;

 private:
  SessionFile(RuntimeFolder folder, std::string name) : folder_(std::move(folder)), name_(std::move(name)) {}
  RuntimeFolder folder_;
  std::string name_;
};

/// The sessions of this user that run on this machine, the oldest first. Files whose master is gone are removed; those
/// of other machines and containers, and what is no session's file, are passed over.
std::vector<RunningSession> running_sessions();

/// Error, naming it: one of them records into this folder.
Status refuse_folder_in_use(const std::string& folder);

/// The address under which processes of this machine reach what is bound to `endpoint`: 127.0.0.1 for every IPv4
/// address of this machine, [::1] for every one, an absolute path for ipc.
std::string local_address(const std::string& endpoint);

/// Without dots, links and a slash at the end, so that two names of a folder are equal; empty stays empty.
std::string absolute_path(const std::string& path);

}  // namespace telesplat::net
