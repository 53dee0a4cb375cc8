// A tune from start to end: runs that measure costs, the model's proposals, runs that check them, the choice.
#pragma once

#include <string>
#include <vector>

#include "tools/common/progress_line.h"
#include "tools/telesplat/sweep/one_run.h"
#include "tools/telesplat/tune/costs.h"
#include "tools/telesplat/tune/scene_text.h"

namespace telesplat::launcher {

class Tune {
 public:
  /// directory: of the runs; it exists. program: telesplat.
  Tune(TuneSubject subject, std::string directory, std::string program);

  /// Settings of the runs that measure costs: the defaults first, then others, so that costs show in several sizes.
  std::vector<TuneSettings> measuring() const;
  int candidates() const { return subject_.request.quick ? 2 : 3; }
  int repetitions() const { return subject_.request.quick ? 2 : 5; }

  /// The interrupted one has found nothing.
  enum class End { kDone, kInterrupted };
  /// Carries all of it out. Error: a run of the defaults failed, or a folder cannot be read or written.
  Result<End> carry_out(tools::ProgressLine& progress);

  /// What it found. Precondition for all: carry_out() has returned kDone.
  const TuneCosts& costs() const { return costs_; }
  const std::vector<Checked>& checked() const { return checked_; }  ///< the defaults first
  const Choice& choice() const { return choice_; }
  const TuneSubject& subject() const { return subject_; }

 private:
  /// One that fails is tried once more.
  Result<RunEnd> run(const TuneSettings& settings, const std::string& name, bool verified, const std::string& what,
                     tools::ProgressLine& progress);
  Result<End> measure(tools::ProgressLine& progress);
  Result<End> check(tools::ProgressLine& progress);

  TuneSubject subject_;
  std::string directory_, program_;
  size_t runs_ = 0, done_ = 0;
  double wall_s_ = 0;  // of those that are done
  TuneCosts costs_;
  std::vector<Checked> checked_;
  Choice choice_;
};

}  // namespace telesplat::launcher
