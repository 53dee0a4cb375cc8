// The Julia set of a run folder: what was shown in each of its epochs.
#pragma once

#include <map>
#include <string>

#include "common/core/ids.h"
#include "common/julia/flags.h"

namespace telesplat::launcher {

struct RecordedJulia {
  std::string directory, title;
  std::string animate;  ///< as --animate took it; empty: nothing
  julia::Parameters begin;
  julia::Placement placement;
  std::map<uint64_t, julia::Parameters> epochs;  ///< by EpochId; of a run without epochs.csv none, it has one set only

  /// Error: epochs.csv has no such epoch.
  Result<julia::Parameters> at(EpochId epoch) const;
};

/// The tables [scene], [julia] and [placement] that session.toml gets of a Julia set.
std::string session_tables(const julia::Scene& scene, const julia::Placement& placement, double room_size_m);

/// Reads what session_tables() wrote, and epochs.csv (epoch,t_s, a column for each parameter). Errors name file, line, value and limit.
/// Precondition: the folder's session.toml says kind = "julia".
Result<RecordedJulia> read_recorded_julia(const std::string& directory);

}  // namespace telesplat::launcher
