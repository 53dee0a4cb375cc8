// What replicas of the point model apply, in order of sequence.
#pragma once

#include <memory>
#include <vector>

#include "common/codec/error_bounds.h"
#include "common/points/point_model.h"
#include "services/packer/points/frame_part.h"

namespace telesplat::packer {

/// A forget event names at most this many clusters; more become several events.
inline constexpr size_t kMaxForgetKeys = 1u << 16;

/// Its FramePart is a patch's; of other events only the epoch counts.
struct Event : FramePart {
  /// Whether it has a sequence, and viewers are to hear of it.
  bool is_told() const { return sequence.value != 0; }
  enum class Kind { kPatch, kForget, kEpoch, kRefine };

  Sequence sequence;  ///< none: nobody need hear of it, and replicas are equal without
  Kind kind = Kind::kPatch;

  // kPatch
  bool frame_complete = false;  ///< the last tile of its frame to be packed
  /// Codec stream of the tile; eliminated pixels are not covered. kRefine: what that of an earlier patch left out.
  std::shared_ptr<const std::vector<uint8_t>> blob;
  /// What the tile may differ by from what was sampled, and how far its farthest point lies, m; 0: it has none.
  codec::ErrorBounds bounds;
  double farthest_m = 0;
  bool refinable = false;  ///< a kRefine of it may come
  /// Of rays finer than a view's: those that met nothing (codec::encode_mask), and where they lie; else none.
  std::vector<uint32_t> missed;
  geometry::Rect missed_rect{0, 0, 1, 1};
  uint32_t rest = 0;  ///< not 0: its points go when the head has moved on; those of one rest of one head share it
  /// Covered pixels of this tile, before and after elimination.
  uint64_t samples = 0, kept = 0;
  uint64_t untold_samples = 0;  ///< of its frame's tiles that nobody was told of, since the last one that was told
  /// The sums over the frame's tiles so far: elimination = 1 - kept / samples.
  uint64_t frame_samples = 0, frame_kept = 0;

  // kForget
  std::vector<points::ClusterKey> clusters;  ///< ascending, at most kMaxForgetKeys
  std::vector<uint32_t> frames;              ///< empty: whole clusters; else one a cluster: its mosaics with this tag

  // kRefine
  Sequence refines;  ///< the patch that becomes exact

  /// What prepare_patch() is told of a patch's frame.
  FrameId tag() const { return points::tagged(frame, step, rest); }
};

}  // namespace telesplat::packer
