// Notes the tiles of each frame that were packed already. Bounded: frames that are never finished do not pile up.
#pragma once

#include <deque>
#include <optional>
#include <unordered_set>
#include <vector>

#include "common/splat/reference/reference_depth.h"
#include "services/packer/points/event.h"

namespace telesplat::packer {

/// Unfinished frames remembered: more than viewers have under way at once. The tiles of an older frame are forgotten;
/// if one of them comes twice then, elimination leaves little of it.
inline constexpr size_t kMaxOpenFrames = 64;
/// Finished frames remembered, to recognise late duplicates. Frames older than a forgotten one count as finished:
/// leases of them are not taken again.
inline constexpr size_t kMaxFinishedFrames = 4096;

class FrameBook {
 public:
  struct Frame {
    FrameId id;
    geometry::Camera camera;
    std::vector<bool> has_tile;
    uint32_t tiles_left = 0;
    uint64_t samples = 0, kept = 0;
    uint64_t untold = 0;  ///< samples of tiles that were not published
    /// Set by add(): the tile brings viewers nothing, and completes nothing that they wait for.
    bool nothing_new = false;
  };

  /// The tiles of a frame that were not packed yet.
  struct Left {
    uint32_t tiles = 0, first = 0;
    uint32_t tiles_in_frame = 0;
  };
  /// Returns the missing tiles; nullopt: the frame is finished. tiles: their number, > 0, if none was packed yet.
  std::optional<Left> left(FrameId frame, uint32_t tiles) const;
  /// True if this tile was packed before.
  bool has(FrameId frame, uint32_t tile) const;
  /// Refuses a tile whose frame had another camera or another number of tiles before.
  Status check(const FramePart& tile) const;
  /// Notes the tile as packed, and its frame as finished if the tile leaves out others. Returns the frame's new state;
  /// with tiles_left = 0 it is finished and no longer open. missed: viewers need the rays of the tile that met nothing.
  /// Preconditions: not a duplicate, checked, tile < tiles_in_frame.
  Frame add(const FramePart& tile, const splat::Elimination& elimination, bool missed);
  void clear();

 private:
  const Frame* find(FrameId id) const;
  bool is_finished(FrameId id) const;

  std::deque<Frame> open_;  // oldest first
  std::deque<FrameId> finished_;
  std::unordered_set<FrameId> is_finished_;
  FrameId forgotten_;  // the newest finished frame that is no longer remembered
};

}  // namespace telesplat::packer
