// The master process: its control socket around MasterCore.
#pragma once

#include "common/net/service.h"
#include "services/master/master_core.h"

namespace telesplat::master {

struct MasterServiceOptions {
  net::ServiceOptions service;  ///< bind: the control socket's address
  MasterOptions master;
  std::string out;      ///< run folder; empty: no record is written
  std::string animate;  ///< as julia::parse_timeline takes it; empty: what the data server says
};

/// Flags that `telesplat run` has too: tiles, leases, packing. (There the data server is told of animations.)
void add_session_flags(CLI::App& app, MasterServiceOptions& options);
void add_flags(CLI::App& app, MasterServiceOptions& options);

/// Serves until SIGINT, SIGTERM or a "stop" command; then tells everyone to finish, waits for them (3 s at most, 1 s after a signal) and writes the
/// record. Prints "listening on ENDPOINT" on stdout when ready. Returns the exit code.
int run(const MasterServiceOptions& options);

}  // namespace telesplat::master
