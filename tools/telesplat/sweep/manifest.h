// The file that lets a sweep continue: DIR/sweep.json has the grid, and the outcome of each run.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/options/table.h"

namespace telesplat::launcher {

/// A flag that varies, and its values in order.
struct Axis {
  std::string flag;  ///< without dashes; "scene": the scene itself
  std::vector<std::string> values;
  bool operator==(const Axis&) const = default;
};

inline constexpr int kMostRepetitions = 1000;

/// A sweep's grid over flags of `telesplat run`; each configuration runs several times.
struct Grid {
  std::string scene;                ///< empty: it is one of the axes
  std::vector<std::string> flags;   ///< those of every run, as `telesplat run` takes them
  std::vector<Axis> axes;           ///< empty: one configuration
  int repeat = 3;                   ///< runs of each configuration
  std::optional<uint64_t> shuffle;  ///< seed of the order within a repetition; nothing: the grid's own order
  bool operator==(const Grid&) const = default;
};

/// One cell of the grid.
struct Configuration {
  std::string name;                 ///< its folder's name
  std::vector<std::string> values;  ///< one for each axis
};

/// Reads one `--vary FLAG=V1,V2,...` into `axes`. If the values contain a semicolon, semicolons separate them and
/// commas belong to them; one at the end is left out. Another --vary of the same flag adds values. flags: those of
/// `telesplat run`. Error: there is no such flag, it refuses a value, or a value stands there twice.
Status add_axis(const std::string& text, const options::Table& flags, std::vector<Axis>& axes);

/// Values of all flags -> the folder's name that a sweep has given them.
using Names = std::map<std::map<std::string, std::string>, std::string>;

/// Returns all cells, the last axis changing fastest. A name holds flags and values, in characters that need no quotes;
/// known cells keep their names, and all names differ.
std::vector<Configuration> configurations(const Grid& grid, const Names& known = {});
Names names_of(const Grid& grid, const std::vector<Configuration>& configurations);

/// "coupling=sync samplers=2", for people; "all runs" if no flag varies.
std::string words(const Grid& grid, const Configuration& configuration);

/// Returns the words behind `telesplat run`. A flag without value is left out if its value is off.
std::vector<std::string> arguments(const Grid& grid, const Configuration& configuration, const options::Table& flags);

struct PlannedRun {
  size_t configuration;
  int repetition;  ///< from 1
};
/// Returns every run. All configurations take their turn before the next repetition begins: a change of the machine's
/// speed affects all of them.
std::vector<PlannedRun> run_order(const Grid& grid, size_t configurations);

/// Checks that a sweep of `before` may go on as one of `wanted`: the same scene and flags, the same flags vary, and no
/// value or repetition is missing. Error: names the difference.
Status check_extends(const Grid& before, const Grid& wanted);

/// The outcome of a run.
struct RunOutcome {
  bool done = false;   ///< the record is complete; else the run failed
  int attempts = 0;    ///< number of its starts
  int exit_code = 0;   ///< that of the last start, or 128 + signal
  std::string reason;  ///< cause of the failure
  std::string begin;   ///< date and time, with time zone
  double wall_s = 0;
};

/// Configuration's name, repetition.
using RunKey = std::pair<std::string, int>;

struct Manifest {
  Grid grid;
  std::string version;    ///< version of the program that began the sweep
  std::string directory;  ///< working folder at the sweep's begin: relative paths of files count from here
  std::vector<Configuration> configurations;
  std::map<RunKey, RunOutcome> outcomes;  ///< a run that has not ended has no entry
};

inline constexpr const char* kManifestFile = "sweep.json";

/// Reads DIR/sweep.json; nothing: there is no such file. Error: it is no manifest, or one of a later version.
Result<std::optional<Manifest>> read_manifest(const std::string& directory);
/// Writes in one step: a reader sees the old file or the new one.
Status write_manifest(const Manifest& manifest, const std::string& directory);

/// The refusal of a folder that holds another sweep than the one asked for. holds: "sweep"; difference: the folder's
/// value, and the value asked for.
Error holds_another(const std::string& folder, const char* holds, const std::string& difference);

/// Returns the manifest of a new sweep.
Manifest begin_manifest(Grid grid, std::string version, std::string directory);
/// Enlarges the grid; outcomes and names stay. Error: that of check_extends().
Status extend(Manifest& manifest, const Grid& wanted);

}  // namespace telesplat::launcher
