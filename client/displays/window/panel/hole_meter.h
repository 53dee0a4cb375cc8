// How much of the object on display is holes, estimated from the picture alone.
#pragma once

#include <array>
#include <cstdint>

#include "common/image/file.h"

namespace telesplat::viewer {

/// A hole is a run of at most kWidest background pixels of a row between runs of the object's that are no narrower,
/// with nothing but the object within kWidest pixels around: what is longer is a gap between lines. Small gaps of the
/// object itself look the same and count too; quality measures (docs/metrics.md) compare with a reference instead.
/// Where most gaps lie beside something narrower, it is thin lines, whose gaps say nothing. Each call looks at every
/// kTurns-th row, so that it costs some tens of microseconds. One thread.
class HoleMeter {
 public:
  static constexpr int kWidest = 8, kTurns = 16;

  /// A frame on display. background: 0x00RRGGBB.
  void look_at(const image::View& view, uint32_t background);
  /// Pixels of holes over those and the object's, in the last kTurns calls; NaN where they have seen no object, or thin
  /// lines.
  double share() const;

 private:
  struct Turn {
    uint64_t object = 0, holes = 0, between_lines = 0;
  };
  std::array<Turn, kTurns> turns_{};
  int turn_ = 0;
};

}  // namespace telesplat::viewer
