// Which tiles of which frames were packed already. Bounded: frames that are never finished do not pile up.
#pragma once

#include <deque>
#include <optional>
#include <unordered_set>
#include <vector>

#include "common/splat/reference/reference_depth.h"
#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Unfinished frames remembered: more than viewers have under way at once. The tiles of an older one are forgotten; if
/// one of them comes twice then, elimination makes little of it.
inline constexpr size_t kMaxOpenFrames = 64;
/// Finished frames remembered, to tell duplicates that come late. Frames that are older than one that was forgotten are
/// taken for finished: leases of them are not taken again.
inline constexpr size_t kMaxFinishedFrames = 4096;

class FrameBook {
 public:
  struct Frame {
    FrameId id;
    geometry::Camera camera;
    std::vector<bool> has_tile;
    uint32_t tiles_left = 0;
    uint64_t samples = 0, kept = 0;
    uint64_t untold = 0;  ///< samples of tiles that nobody was told of
    /// Of add(): the tile leaves viewers nothing to do, and completes nothing that they wait for.
    bool nothing_new = false;
  };

  /// Of a frame, what was not packed yet.
  struct Left {
    uint32_t tiles = 0, first = 0;
    uint32_t tiles_in_frame = 0;
  };
  /// `tiles`: that the frame has, where none of it was packed. Nothing: the frame is finished. Precondition: tiles > 0.
  std::optional<Left> left(FrameId frame, uint32_t tiles) const;
  /// True if this tile was packed before.
  bool has(FrameId frame, uint32_t tile) const;
  /// Refuses a tile whose frame was said to have another camera or another number of tiles.
  Status check(const FramePart& tile) const;
  /// Notes the tile as packed, and its frame as finished if it leaves out others. Returns its frame as it is then;
  /// finished and forgotten if tiles_left is 0. missed: viewers are to know of rays of the tile that met nothing.
  /// Preconditions: not a duplicate, checked, tile < tiles_in_frame.
  Frame add(const FramePart& tile, const splat::Elimination& elimination, bool missed);
  void clear();

 private:
  const Frame* find(FrameId id) const;
  bool is_finished(FrameId id) const;

  std::deque<Frame> open_;  // oldest first
  std::deque<FrameId> finished_;
  std::unordered_set<FrameId> is_finished_;
  FrameId forgotten_;  // the newest of the finished ones that are not remembered
};

}  // namespace telesplat::packer
