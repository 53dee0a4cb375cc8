// Rows of a frame that were sampled before, and what each cost: for measuring how work is shared out among more
// samplers than there are processors. One line of JSON {"width", "height", "row_cost_s": [...]}, then the frame as a
// codec stream.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/depth_image.h"

namespace telesplat::sampler {

struct Replay {
  image::DepthImage frame;
  std::vector<double> row_cost_s;  ///< one a row, seconds of a sampler of one thread, sampling and encoding
};

/// Error: cannot be written.
Status write_replay(const std::string& path, const Replay& replay);
/// Error: names the file and what is wrong with it: no such file, over 1 GiB, not of this form, costs not finite or
/// negative.
Result<Replay> read_replay(const std::string& path);

}  // namespace telesplat::sampler
