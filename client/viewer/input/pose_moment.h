// When a head was where a frame shows it.
#pragma once

namespace telesplat::viewer {

/// Seconds; taken_s on the monotonic clock.
struct PoseMoment {
  double taken_s = 0;  ///< the newest pose that it was made from was taken
  double ahead_s = 0;  ///< it was predicted so far beyond that
};

}  // namespace telesplat::viewer
