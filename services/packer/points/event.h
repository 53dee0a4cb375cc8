// What a tile is of, as it was sampled, and what replicas of the point model apply, in order of sequence.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/codec/error_bounds.h"
#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"
#include "common/points/point_model.h"

namespace telesplat::packer {

// What a tile is of: its label, which goes unchanged from the lease to the patch.

/// A frame of more tiles is refused.
inline constexpr uint32_t kMaxTilesInFrame = 1u << 16;

/// A rectangle of a frame, and whose frame that is.
struct FramePart {
  FrameId frame;
  EpochId epoch;
  InstanceId viewer;  ///< who asked for the frame,
  RequestId request;  ///< and with which request
  uint32_t tile = 0, tiles_in_frame = 0;
  uint32_t step = 1;        ///< the frame has every step-th pixel of every step-th row of the view
  geometry::Camera camera;  ///< of the whole frame
  geometry::Rect rect;      ///< the tile in it
  bool extra = false;       ///< of rays beyond what the view asked for: it completes no update
  /// Not 0: it ends its frame, of which so many tiles, itself included, are not sampled.
  uint32_t left_out = 0;
};

/// "tile 3 of frame 17". noun: what the part is called in messages.
std::string name_of(const FramePart& part, std::string_view noun);

/// Error: the camera is none, the frame has no tile of that number, or the rectangle does not lie in it.
Status check(const FramePart& part, std::string_view noun);

/// "96x40 pixels at (0, 24)".
std::string describe(const geometry::Rect& rect);

// A tile as a sampler sent it, decoded.

struct SampledTile : FramePart {
  image::DepthImage image;  ///< canonical, of rect's size
  /// Of rays finer than a view's: those that met nothing, of rect's size; else empty.
  image::PixelMask missed{};
};

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

// What the model shows where a tile was sampled, from whoever has rendered it already.

struct KnownReference {
  const image::PixelMask& cast;      ///< of the tile's size: no other pixel of it is covered
  std::span<const float> nearest_m;  ///< of its frame: render_reference_depth(), but for samples of the frame itself
};

// Who wants to know what happens to the packer's model.

class ModelWatcher {
 public:
  virtual ~ModelWatcher() = default;
  /// Before the patch goes in.
  virtual void inserted(const points::PreparedPatch& patch) = 0;
  /// Clusters, or patches of them, were dropped.
  virtual void forgotten(std::span<const points::ClusterKey> clusters) = 0;
  /// Everything was dropped: a new epoch.
  virtual void cleared() = 0;
};

}  // namespace telesplat::packer
