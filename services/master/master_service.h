// The master process: its control socket around MasterCore.
#pragma once

#include "services/master/master_options.h"

namespace telesplat::master {

/// Serves until SIGINT, SIGTERM or a "stop" command; then tells everyone to finish, waits for them (3 s at most, 1 s
/// after a signal) and writes the record. Prints "listening on ENDPOINT" on stdout when ready. Returns the exit code.
Result<int> run(const MasterServiceOptions& options);

}  // namespace telesplat::master
