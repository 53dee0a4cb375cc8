// Which of several measured configurations is taken, and whether the machine was quiet enough to tell.
#pragma once

#include <string>
#include <vector>

#include "tools/telesplat/sweep/figures.h"

namespace telesplat::launcher {

/// What a run is judged by. A figure that was not measured is NaN, and judges nothing; of a run that did not come to
/// its end all are.
struct TuneFigures {
  double latency_ms, age_ms, psnr_db, frame_ms, updates_per_s;
};
/// From the numbers of a run's summary.json.
TuneFigures tune_figures(const Figures& summary);

/// A configuration with its runs, one a round; the defaults are one, too.
struct Measured {
  std::string name;
  std::vector<TuneFigures> runs;
};

/// A figure over the runs that have it; runs 0: none has.
Spread spread_of(const Measured& measured, double TuneFigures::*figure);

enum class Verdict {
  kBetter,        ///< the chosen one is better than the defaults in every round
  kDefaultsBest,  ///< none is, and rounds differed little; or there was none
  kTooNoisy       ///< rounds differed too much to tell, and not all others were clearly worse
};

struct Choice {
  Verdict verdict = Verdict::kDefaultsBest;
  size_t chosen = 0;                 ///< place in the list; 0: the defaults
  std::vector<std::string> reasons;  ///< one for each of the list: why it is taken or not
  std::string sentence;              ///< for people
};

/// The most that rounds may lie apart, as a mean, in what a configuration gains in latency, before a verdict counts for
/// nothing.
inline constexpr double kQuiet = 0.1;

/// all[0]: the defaults. Each round compares a configuration with the defaults' run of that round. A configuration can
/// be chosen if in no figure (latency, age, PSNR, frame time) it is worse, as a median of rounds, by more than rounds
/// lie apart, and never by more than 5 % (0.5 dB); and if in each of at least two rounds latency is less, or PSNR more.
/// Of these the best by score() is taken. Precondition: the defaults have a run.
Choice choose(const std::vector<Measured>& all);

}  // namespace telesplat::launcher
