// Tiles from a file. Each takes as long as its rows cost when they were sampled, by waiting, so that many more samplers
// than processors can be studied. Leases, encoding and messages are those of other tiles.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/depth_image.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

// Rows of a frame that were sampled before, and what each cost: for measuring how work is shared out among more
// samplers than there are processors. One line of JSON {"width", "height", "row_cost_s": [...]}, then the frame as a
// codec stream.

struct Replay {
  image::DepthImage frame;
  std::vector<double> row_cost_s;  ///< one a row, seconds of a sampler of one thread, sampling and encoding
};

/// Error: cannot be written.
Status write_replay(const std::string& path, const Replay& replay);
/// Error: names the file and what is wrong with it: no such file, over 1 GiB, not of this form, costs not finite or
/// negative.
Result<Replay> read_replay(const std::string& path);

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
