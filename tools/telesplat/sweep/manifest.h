// The file by which a sweep goes on where it was: DIR/sweep.json has the grid, and what became of each run.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/telesplat/sweep/grid.h"
#include "tools/telesplat/sweep/load.h"

namespace telesplat::launcher {

/// What became of a run.
struct RunOutcome {
  bool done = false;   ///< its record is complete; else it failed
  int attempts = 0;    ///< times that it was started
  int exit_code = 0;   ///< of the last one, or 128 + signal
  std::string reason;  ///< why it failed
  std::string begin;   ///< date and time, with time zone
  double wall_s = 0;
  Load load;
};

/// Configuration's name, repetition.
using RunKey = std::pair<std::string, int>;

struct Manifest {
  Grid grid;
  std::string version;    ///< of the program that began the sweep
  std::string directory;  ///< in which it was begun: relative paths of files count from here
  std::vector<Configuration> configurations;
  std::map<RunKey, RunOutcome> outcomes;  ///< runs that are not here have not ended
};

inline constexpr const char* kManifestFile = "sweep.json";

/// Reads DIR/sweep.json; nothing: there is none. Error: it is no manifest, or one of a later version.
Result<std::optional<Manifest>> read_manifest(const std::string& directory);
/// In one step: a reader sees the file before or the one after.
Status write_manifest(const Manifest& manifest, const std::string& directory);

/// The refusal of a folder that was begun with something else than what is asked for now. holds: "sweep"; difference:
/// what it has, and what is asked for.
Error holds_another(const std::string& folder, const char* holds, const std::string& difference);

/// Manifest of a sweep that begins.
Manifest begin_manifest(Grid grid, std::string version, std::string directory);
/// The same with a larger grid; outcomes and names stay. Error: what check_extends() says.
Status extend(Manifest& manifest, const Grid& wanted);

}  // namespace telesplat::launcher
