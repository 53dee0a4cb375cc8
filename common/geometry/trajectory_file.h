// The samples of a recorded head movement, for who needs their own times.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/trajectory.h"

namespace telesplat::geometry {

/// What Trajectory::read_csv reads, with the file's times. Errors as there.
Result<std::vector<Trajectory::Sample>> read_samples(const std::string& path);

}  // namespace telesplat::geometry
