// A sweep from start to end: what is to be run, the runs, what they leave.
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

/// One run of a sweep: `telesplat run` as a child process, watched until it has ended.
struct RunRequest {
  std::string program;                 ///< telesplat
  std::vector<std::string> arguments;  ///< run, scene, flags, --out
  std::string log;                     ///< file that what it says on stderr is appended to
  double limit_s = 0;                  ///< it is ended when it takes longer, and has failed; 0: no limit
};

struct RunEnd {
  int exit_code = 0;         ///< or 128 + signal
  std::string reason;        ///< empty: it is done
  bool interrupted = false;  ///< this process was told to stop meanwhile
  double wall_s = 0;
};

/// Runs it to its end. watch(seconds since its start) is called every 50 ms. If this process is told to stop, the run
/// is told once (it ends in order), and again if that is repeated; the third time it is killed.
RunEnd carry_out(const RunRequest& request, const std::function<void(double)>& watch);

inline constexpr uintmax_t kMostLastWords = 1 << 20;
/// What was written to a file behind its first `offset` bytes, the last kMostLastWords bytes of it.
std::string last_words(const std::string& path, uintmax_t offset);

/// What a run said last that it complained about: the last line that begins "telesplat: ", else the last one; without
/// control characters, 300 bytes at most.
std::string complaint_in(const std::string& log);

/// A run that is to be carried out.
struct NextRun {
  size_t configuration;
  int repetition;
};

class Sweep {
 public:
  /// directory: of the sweep; it exists, and nobody else writes into it. program: telesplat. limit_s: as RunRequest has
  /// it; 0: ten times the time that a run lasts, and ten minutes.
  Sweep(Manifest manifest, std::string directory, std::string program, double limit_s);

  /// Asks of every configuration what `telesplat run` would refuse. Error: the first refusal, and of which one.
  Status check();
  /// Runs that are not done, in the order in which they will be carried out. One that failed is among them.
  std::vector<NextRun> to_do() const;
  /// The command line of a run.
  std::vector<std::string> command(const NextRun& run) const;

  enum class End { kDone, kInterrupted };
  /// Carries all of them out. Each is tried twice; one that fails twice is noted as failed, and the sweep goes on. The
  /// manifest is written after each. Error: the folder cannot be written to.
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
  std::vector<double> lasts_s_;  // a configuration's runs, as they are asked for; 0: not known
};

/// What this run took part in: median of those of its configuration that are done, else of all that are done, else what
/// it is asked to last and what starting takes; seconds.
double expected_wall_s(const Manifest& manifest, size_t configuration, double lasts_s);

/// arguments: the words behind `telesplat run`. Looks at flags, values and the scene as the command itself does, and
/// starts nothing. Returns how long the run will last, in seconds; 0: not known, it ends after a number of frames.
/// Error: what `telesplat run` would refuse; that the run would not end; that --out, --overwrite, --master or --movie
/// is given, which are the sweep's business or would not be of one run.
Result<double> check_run(const std::vector<std::string>& arguments);

}  // namespace telesplat::launcher
