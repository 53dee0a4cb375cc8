// Labels and contents of sampled tiles, and the events that replicas of the point model apply in order of sequence.
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
#include "common/splat/reference/reference_depth.h"

namespace telesplat::packer {

using splat::KnownReference;

// A tile's label: it goes unchanged from the lease to the patch.

/// A frame of more tiles is refused.
inline constexpr uint32_t kMaxTilesInFrame = 1u << 16;

/// A rectangle of a frame, with the viewer and the request that the frame answers.
struct FramePart {
  FrameId frame;
  EpochId epoch;
  InstanceId viewer;  ///< viewer that asked for the frame,
  RequestId request;  ///< and with which request
  uint32_t tile = 0, tiles_in_frame = 0;
  uint32_t step = 1;        ///< the frame has every step-th pixel of every step-th row of the view
  geometry::Camera camera;  ///< the whole frame's camera
  geometry::Rect rect;      ///< the tile in it
  bool extra = false;       ///< rays beyond what the view asked for: the tile completes no update
  /// Not 0: the tile ends its frame; this many of the frame's tiles, itself included, are not sampled.
  uint32_t left_out = 0;
  bool coarse = false;  ///< sampled from coarser data than the frame asks for: it is to be sampled again
  /// True if its points are removed once a later frame is complete.
  bool provisional() const { return step > 1 || coarse; }
};

/// Returns "tile 3 of frame 17". noun: the word for the part in messages.
std::string name_of(const FramePart& part, std::string_view noun);

/// Error: the camera is not valid, the frame has no tile of that number, or the rectangle does not lie in the frame.
Status check(const FramePart& part, std::string_view noun);

/// Returns "96x40 pixels at (0, 24)".
std::string describe(const geometry::Rect& rect);

// A tile as a sampler sent it, decoded.

struct SampledTile : FramePart {
  image::DepthImage image;  ///< canonical, as large as rect
  /// Rays of a finer view that met nothing, as large as rect; empty for other tiles.
  image::PixelMask missed{};
};

/// Clusters in one forget event, at most; more clusters make several events.
inline constexpr size_t kMaxForgetKeys = 1u << 16;

/// An event of the model. Patches use the whole FramePart, other events only its epoch.
struct Event : FramePart {
  /// True if the event has a sequence and goes to viewers.
  bool is_told() const { return sequence.value != 0; }
  enum class Kind { kPatch, kForget, kEpoch, kRefine };

  Sequence sequence;  ///< 0: the event is not published, and replicas are equal without it
  Kind kind = Kind::kPatch;

  // kPatch
  bool frame_complete = false;  ///< the last tile of its frame to be packed
  /// Codec stream of the tile; eliminated pixels are not covered. kRefine: what the earlier patch's stream left out.
  std::shared_ptr<const std::vector<uint8_t>> blob;
  /// Largest error of the tile against its samples, and distance of its farthest point, m; 0: no points.
  codec::ErrorBounds bounds;
  double farthest_m = 0;
  bool refinable = false;  ///< a kRefine of this patch may follow
  /// Rays of a finer view that met nothing (codec::encode_mask), and their rectangle; empty for other tiles.
  std::vector<uint32_t> missed;
  geometry::Rect missed_rect{0, 0, 1, 1};
  uint32_t rest = 0;  ///< not 0: number of the head's rest; its points are forgotten when the head has moved on
  /// Covered pixels of this tile, before and after elimination.
  uint64_t samples = 0, kept = 0;
  uint64_t untold_samples = 0;  ///< samples in its frame's unpublished tiles since the last published one
  /// Sums over the frame's tiles up to this one: elimination = 1 - kept / samples.
  uint64_t frame_samples = 0, frame_kept = 0;

  // kForget
  std::vector<points::ClusterKey> clusters;  ///< ascending, at most kMaxForgetKeys
  std::vector<uint32_t> frames;              ///< empty: whole clusters; else per cluster the frame tag to forget

  // kRefine
  Sequence refines;  ///< sequence of the patch that becomes exact

  /// The frame tag that prepare_patch() gets for a patch.
  FrameId tag() const { return points::tagged(frame, provisional(), rest); }
};

// Observer of the packer's model.

class ModelWatcher {
 public:
  virtual ~ModelWatcher() = default;
  /// Called before the patch is inserted.
  virtual void inserted(const points::PreparedPatch& patch) = 0;
  /// Clusters, or single patches of them, were dropped.
  virtual void forgotten(std::span<const points::ClusterKey> clusters) = 0;
  /// Everything was dropped: a new epoch began.
  virtual void cleared() = 0;
};

}  // namespace telesplat::packer
