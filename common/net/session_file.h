// A session's master leaves a file in the user's runtime folder while it runs, so that `telesplat ctl` and other
// programs of this user on this machine find it without an address.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/net/runtime_folder.h"

namespace telesplat::net {

/// Content of a session's file.
struct RunningSession {
  std::string address;      ///< the master's address for processes of this machine
  uint64_t pid = 0;         ///< the master's process number
  std::string scene, kind;  ///< empty: not known yet
  std::string run_folder;   ///< absolute path; empty: no record
  double started_at_s = 0;  ///< wall clock, seconds since 1970
  std::string started_by;   ///< "run", "view", "bench"; "hand": a person started the master itself
  std::string keys;         ///< folder of its keys, absolute path; empty: without keys
  bool operator==(const RunningSession&) const = default;
};

/// The file of a session of this process; the destructor removes it.
class SessionFile {
 public:
  /// session.pid is this process. Error: the file cannot be written; the session runs, but others do not find it.
  static Result<SessionFile> publish(const RunningSession& session);
  ~SessionFile();
  SessionFile(SessionFile&& other) noexcept
      : folder_(std::move(other.folder_)), name_(std::exchange(other.name_, {})) {}
  SessionFile& operator=(SessionFile&&) = delete;

  /// Writes the file anew with newer facts.
  Status update(const RunningSession& session) const;

 private:
  SessionFile(RuntimeFolder folder, std::string name) : folder_(std::move(folder)), name_(std::move(name)) {}
  RuntimeFolder folder_;
  std::string name_;
};

/// The sessions of this user that run on this machine, the oldest first. Removes files whose master is gone; ignores
/// those of other machines and containers, and files that describe no session.
std::vector<RunningSession> running_sessions();

/// Error, naming the session: it records into this folder.
Status refuse_folder_in_use(const std::string& folder);

/// The address under which processes of this machine reach a socket bound to `endpoint`: 127.0.0.1 for the wildcard of
/// IPv4, [::1] for that of IPv6, an absolute path for ipc.
std::string local_address(const std::string& endpoint);

/// Removes dots, links and the last slash, so that two names of a folder become equal; empty stays empty.
std::string absolute_path(const std::string& path);

}  // namespace telesplat::net
