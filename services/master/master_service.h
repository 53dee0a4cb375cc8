// The master process: its control socket around MasterCore.
#pragma once

#include <memory>

#include "common/net/turns.h"
#include "services/master/master_options.h"

namespace telesplat::master {

class MasterCore;

/// Ends after a signal or "stop", once all processes have left or the time that run() gives them is over.
class MasterService : public net::Turns {
 public:
  /// Begins the record and binds the control socket. Context and options must outlive it.
  static Result<std::unique_ptr<MasterService>> open(net::Context& context, const MasterServiceOptions& options);
  virtual const MasterCore& core() const = 0;
  /// To be called after its last turn.
  virtual Status write_record() = 0;
};

/// Serves until SIGINT, SIGTERM or a "stop" command; then sends Shutdown to all, waits for them (3 s at most, 1 s
/// after a signal) and writes the record. Prints "listening on ENDPOINT" on stdout when ready. Returns the exit code.
Result<int> run(const MasterServiceOptions& options);

}  // namespace telesplat::master
