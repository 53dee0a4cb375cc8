// The file by which a sweep goes on where it was: DIR/sweep.json has the grid, and what became of each run.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/options/table.h"

namespace telesplat::launcher {

/// A flag that varies, and its values in their order.
struct Axis {
  std::string flag;  ///< without dashes; "scene": the scene itself
  std::vector<std::string> values;
  bool operator==(const Axis&) const = default;
};

inline constexpr int kMostRepetitions = 1000;

/// What a sweep runs: a grid over flags of `telesplat run`, each of its configurations several times.
struct Grid {
  std::string scene;                ///< empty: it varies
  std::vector<std::string> flags;   ///< of every run, as `telesplat run` takes them
  std::vector<Axis> axes;           ///< none: one configuration
  int repeat = 3;                   ///< runs of each configuration
  std::optional<uint64_t> shuffle;  ///< seed of the order within a repetition; none: the grid's own order
  bool operator==(const Grid&) const = default;
};

/// One cell of the grid.
struct Configuration {
  std::string name;                 ///< of its folder
  std::vector<std::string> values;  ///< one for each axis
};

/// Reads one `--vary FLAG=V1,V2,...` into `axes`. Where a semicolon stands among the values, semicolons separate them
/// and commas belong to them; one at the end is left out. Another --vary of the same flag adds values. flags: those of
/// `telesplat run`. Error: it has no such flag, a value is wrong for it, or stands there twice.
Status add_axis(const std::string& text, const options::Table& flags, std::vector<Axis>& axes);

/// Names of folders, by the values of all flags: those that a sweep has given already.
using Names = std::map<std::map<std::string, std::string>, std::string>;

/// All cells, the last axis changing fastest. A name says flags and values, in characters that need no quotes; known
/// ones keep the name they have, and no two have the same.
std::vector<Configuration> configurations(const Grid& grid, const Names& known = {});
Names names_of(const Grid& grid, const std::vector<Configuration>& configurations);

/// "coupling=sync samplers=2", for people; "all runs" where nothing varies.
std::string words(const Grid& grid, const Configuration& configuration);

/// The words behind `telesplat run`. A flag without value is given where its value is on.
std::vector<std::string> arguments(const Grid& grid, const Configuration& configuration, const options::Table& flags);

struct PlannedRun {
  size_t configuration;
  int repetition;  ///< from 1
};
/// Every run. All configurations take their turn before the next repetition begins, so that a machine that becomes
/// slower or faster does so for all of them.
std::vector<PlannedRun> run_order(const Grid& grid, size_t configurations);

/// Whether a sweep of `before` may go on as one of `wanted`: the same scene and flags, the same flags vary, and no
/// value or repetition is missing. Error: what differs.
Status check_extends(const Grid& before, const Grid& wanted);

/// What became of a run.
struct RunOutcome {
  bool done = false;   ///< its record is complete; else it failed
  int attempts = 0;    ///< times that it was started
  int exit_code = 0;   ///< of the last one, or 128 + signal
  std::string reason;  ///< why it failed
  std::string begin;   ///< date and time, with time zone
  double wall_s = 0;
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
