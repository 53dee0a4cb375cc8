// Tiles from a file. Each waits for as long as its rows took when they were sampled, so that many more samplers than
// processors can be studied. Leases, encoding and messages are those of other tiles.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/depth_image.h"
#include "services/sampler/tiles/tile_source.h"

namespace telesplat::sampler {

// Rows of a frame that were sampled before, and the time that each took: to measure how work is shared out among more
// samplers than there are processors. One line of JSON {"width", "height", "row_cost_s": [...]}, then the frame as a
// codec stream.

struct Replay {
  image::DepthImage frame;
  std::vector<double> row_cost_s;  ///< for each row: seconds of one thread, sampling and encoding
};

/// Error: the file cannot be written.
Status write_replay(const std::string& path, const Replay& replay);
/// Error: names the file and the fault: no such file, over 1 GiB, not of this form, or costs that are negative or not
/// finite.
Result<Replay> read_replay(const std::string& path);

class ReplayTiles final : public TileSource {
 public:
  ReplayTiles(Replay replay, double cost_scale);

  const char* name() const override { return "replay"; }
  void on_welcome(const wire::Welcome&) override {}
  /// A lease begins when the one before has ended, or when it came, and takes its part of the pixels' time. Begin and
  /// end are the times that were due, not those at which this process woke up: late awakenings do not add up. Hopeless:
  /// a frame of another size, or a coarse one.
  Readiness readiness(const HeldLease& lease, double now_s) override;
  Sampled sample(const HeldLease& lease) override;

 private:
  Replay replay_;
  std::vector<double> cost_before_s_;  // for each row: cost of all rows above it
  LeaseId lease_;                      // the lease that is being replayed
  double begin_s_ = 0, end_s_ = 0;
};

}  // namespace telesplat::sampler
