// A sweep from start to end: what is to be run, the runs, what they leave.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/sweep/manifest.h"
#include "tools/telesplat/sweep/one_run.h"

namespace telesplat::launcher {

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

}  // namespace telesplat::launcher
