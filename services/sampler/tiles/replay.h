// Leases answered from a file: each takes as long as its rows cost when they were sampled, by waiting, so that many more samplers than
// processors can be studied. Everything else (leases, encoding, messages) is as ever.
#pragma once

#include <optional>

#include "services/sampler/tiles/replay_file.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

class ReplayWork final : public LeaseWork {
 public:
  ReplayWork(Replay replay, double cost_scale);

  const char* name() const override { return "replay"; }
  void on_welcome(const wire::Welcome&) override {}
  /// A lease begins when the one before has ended, or when it came; both are instants as they should be, not as this process woke up, so
  /// that late awakenings do not add up. Hopeless: a frame of another size, or a coarse one.
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;

 private:
  Replay replay_;
  std::vector<double> cost_before_s_;  // of all rows above
  LeaseId lease_;                      // the one that is waited for
  double begin_s_ = 0, end_s_ = 0;
};

}  // namespace telesplat::sampler
