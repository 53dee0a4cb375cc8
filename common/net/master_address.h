// Finds the master of a program that is started without an address.
#pragma once

#include <string>

#include "common/net/session_file.h"

namespace telesplat::net {

/// The environment variable that names a session's master; used without --master.
inline constexpr const char* kMasterVariable = "TELESPLAT_MASTER";
/// Instead of an address: the one session of this user that runs on this machine.
inline constexpr const char* kTheOneMaster = "auto";

/// Value of the variable; empty if it is not set.
std::string master_from_environment();

/// A master's address, or the reason why none was found.
struct MasterSearch {
  std::string address;   ///< empty: none was found
  std::string problem;   ///< reason, if the address is empty; lists the sessions to choose from, a line each
  std::string keys;      ///< folder of the session's keys, if the session was found here; else empty
  bool several = false;  ///< the person must choose, or gave an invalid address: bad usage
  int exit_code() const { return several ? 2 : 1; }
};

/// master: an address, which comes back as it is, with the keys of this user's session at that address; "auto" or
/// empty: a session that runs on this machine. session: selects it by the master's process number, or by the scene's or
/// the run folder's name with or without its path; empty: there must be exactly one.
MasterSearch find_master(const std::string& master, const std::string& session = {});

/// A session in one line, for a person who must choose.
std::string described(const RunningSession& session);

}  // namespace telesplat::net
