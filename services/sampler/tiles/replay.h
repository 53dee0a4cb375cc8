// Tiles from a file. Each takes as long as its rows cost when they were sampled, by waiting, so that many more samplers
// than processors can be studied. Leases, encoding and messages are those of other tiles.
#pragma once

#include <optional>

#include "services/sampler/tiles/replay_file.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class ReplayTiles final : public TileSource {
 public:
  ReplayTiles(Replay replay, double cost_scale);

  const char* name() const override { return "replay"; }
  void on_welcome(const wire::Welcome&) override {}
  /// A lease begins when the one before has ended, or when it came, and costs its part of the pixels. Both are the
  /// instants that were due, not those at which this process woke up: late awakenings do not add up. Hopeless: a frame
  /// of another size, or a coarse one.
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;

 private:
  Replay replay_;
  std::vector<double> cost_before_s_;  // of all rows above
  LeaseId lease_;                      // the one that is waited for
  double begin_s_ = 0, end_s_ = 0;
};

}  // namespace telesplat::sampler
