// Runs a sweep from start to end: its list of runs, the runs, their outcomes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/sweep/manifest.h"

namespace telesplat::launcher {

/// One run of a sweep: `telesplat run` as a child process, watched until it ends.
struct RunRequest {
  std::string program;                 ///< telesplat
  std::vector<std::string> arguments;  ///< run, scene, flags, --out
  std::string log;                     ///< file that its stderr is appended to
  double limit_s = 0;                  ///< a run that takes longer is ended, and has failed; 0: no limit
};

struct RunEnd {
  int exit_code = 0;         ///< or 128 + signal
  std::string reason;        ///< why it failed; empty: it is done
  bool interrupted = false;  ///< a signal came to this process meanwhile
  double wall_s = 0;
};

/// Runs a request to its end. Calls watch(seconds since its start) every 50 ms. Passes signals to this process on: the
/// first one lets the run end in order, the second one again, the third one kills it.
RunEnd carry_out(const RunRequest& request, const std::function<void(double)>& watch);

inline constexpr uintmax_t kMostLastWords = 1 << 20;
/// Returns the end of a file: the bytes after its first `offset`, at most the last kMostLastWords of them.
std::string last_words(const std::string& path, uintmax_t offset);

/// Returns a run's last complaint: the last line that begins "telesplat: ", else the last line; without control
/// characters, 300 bytes at most.
std::string complaint_in(const std::string& log);

/// A run that is still to be carried out.
struct NextRun {
  size_t configuration;
  int repetition;
};

class Sweep {
 public:
  /// directory: the sweep's; it exists, and no other process writes into it. program: telesplat. limit_s: that of
  /// RunRequest; 0: ten times a run's length, and ten minutes.
  Sweep(Manifest manifest, std::string directory, std::string program, double limit_s);

  /// Checks every configuration as `telesplat run` would. Error: the first refusal, and its configuration.
  Status check();
  /// Returns the runs that are not done, failed ones too, in their order.
  std::vector<NextRun> to_do() const;
  /// Returns the command line of a run.
  std::vector<std::string> command(const NextRun& run) const;

  enum class End { kDone, kInterrupted };
  /// Carries all of them out. Tries each twice; a run that fails twice is noted as failed, and the sweep goes on.
  /// Writes the manifest after each. Error: the folder cannot be written to.
  Result<End> carry_out(tools::ProgressLine& progress);

  const Manifest& manifest() const { return manifest_; }
  size_t runs() const { return manifest_.configurations.size() * size_t(manifest_.grid.repeat); }

 private:
  std::string folder(const NextRun& run) const;
  double expected_s(size_t configuration) const;
  Result<RunEnd> attempt(const NextRun& run, const std::function<void(double)>& watch) const;

  Manifest manifest_;
  std::string directory_, program_;
  double limit_s_;
  std::vector<double> lasts_s_;  // length of a configuration's runs, by their flags; 0: unknown
};

/// Returns the expected time of a run, in seconds: the median of the configuration's completed runs, else of all
/// completed runs, else its length by its flags and the time of starting.
double expected_wall_s(const Manifest& manifest, size_t configuration, double lasts_s);

/// arguments: the words behind `telesplat run`. Checks flags, values and the scene as the command itself does, and
/// starts nothing. Returns the run's length, in seconds; 0: unknown, it ends after a number of frames. Error:
/// `telesplat run` would refuse it; the run would not end; or --out, --overwrite, --master or --movie is given, which
/// the sweep sets itself or which do not fit a single run.
Result<double> check_run(const std::vector<std::string>& arguments);

}  // namespace telesplat::launcher
