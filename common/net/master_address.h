// Which master a program means that is not told one.
#pragma once

#include <string>

#include "common/net/session_file.h"

namespace telesplat::net {

/// The environment variable that names a session's master where --master is not given.
inline constexpr const char* kMasterVariable = "TELESPLAT_MASTER";
/// In an address' place: the one session of this user that runs on this machine.
inline constexpr const char* kTheOneMaster = "auto";

/// Its value; empty where it is not set.
std::string master_from_environment();

/// A master's address, or why there is none.
struct MasterSearch {
  std::string address;   ///< empty: there is none
  std::string problem;   ///< then; sessions among which to choose are told in lines of their own
  std::string keys;      ///< folder of the keys that the session runs with, if it was found here; empty: none are known
  bool several = false;  ///< the person must choose, or gave what is no address: bad usage
  int exit_code() const { return several ? 2 : 1; }
};

/// master: an address, which comes back as it is, with the keys of the session of this user that is there; "auto" or
/// empty: a session that runs on this machine. session: which one: the master's process number, the scene's or the run
/// folder's name with or without its path; empty: there must be one alone.
MasterSearch find_master(const std::string& master, const std::string& session = {});

/// A session in one line, for a person who must choose.
std::string described(const RunningSession& session);

}  // namespace telesplat::net
