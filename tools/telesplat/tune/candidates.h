// Which settings the model would choose, among all that can be chosen.
#pragma once

#include <string>
#include <vector>

#include "tools/telesplat/tune/model.h"

namespace telesplat::launcher {

/// Values of each parameter, ascending. One value: it is not tuned.
struct TuneGrid {
  std::vector<int> samplers, tile_px;
  std::vector<double> scale;  ///< of fixed sampling sizes; the adaptive one of the defaults comes besides
  bool adaptive = true;       ///< whether --sampling-size auto is among what can be chosen
  std::vector<int> octree_depth;
  std::vector<double> update_rate_hz;
};

/// All that is worth a thought on a machine of so many cores, around `defaults`. largest_samplers: of --samplers.
TuneGrid grid_around(const TuneSettings& defaults, int cores, int largest_samplers);
/// Every combination, `defaults` first.
std::vector<TuneSettings> settings_of(const TuneGrid& grid, const TuneSettings& defaults);
/// In how many parameters they differ.
int differences(const TuneSettings& a, const TuneSettings& b);

struct Candidate {
  TuneSettings settings;
  Prediction predicted;
  double score = 0;  ///< score() against the defaults
};

/// How much better `p` is than `base`: the logarithm of how many times smaller the latency is, and of quality so much
/// that 3 dB count as half the latency. Above 0: better. It is what predictions and measurements are compared by.
double score(double latency_s, double quality_db, double base_latency_s, double base_quality_db);

/// At most `count` settings for a check by runs: the best by score, then that of least latency and that of best
/// quality, then the next best. They are predicted to be better than the defaults, and in latency, quality, age and
/// frame time not worse by more than a hundredth (0.1 dB). Where there are fewer than two, the best of those follow
/// that are not worse by more than a fifth (1 dB), for the model may err. None is predicted to be like another. Of two
/// that score alike, the one that changes less of the defaults comes first.
std::vector<Candidate> propose(const TuneCosts& costs, const TuneSettings& defaults, const TuneGrid& grid, int count);

}  // namespace telesplat::launcher
