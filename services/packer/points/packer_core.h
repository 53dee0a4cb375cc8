// The packer without its sockets and clocks (T4.3): sampled tiles and access reports come in, point-model events go
// out. One thread at a time.
#pragma once

#include <algorithm>
#include <bit>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/codec/error_bounds.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/points/point_model.h"
#include "common/splat/reference/reference_depth.h"
#include "services/packer/points/event.h"
#include "services/packer/points/event_log.h"

namespace telesplat::packer {

// How far published points may be from sampled ones, as people say it.

struct AllowedErrors {
  double depth_pixels = 0;  ///< of a pixel's footprint at that depth, along the line of sight; 0: none
  int normal = 0;           ///< codes of the octahedral map, each coordinate
  int colour = 0;           ///< of each channel, of 255

  bool exact() const { return depth_pixels <= 0 && normal <= 0 && colour <= 0; }
  bool operator==(const AllowedErrors&) const = default;
};

/// The same for the pixels of one camera, those of the finer axis. Frusta are wider the faster a head moves: bounds of
/// depth are rounded down to one of 16 an octave, so that coders, which keep tables by bound, do not make one a frame.
inline codec::ErrorBounds bounds_of(const AllowedErrors& allowed, const geometry::Camera& camera) {
  if (allowed.exact()) return {};
  constexpr int kBits = 5;
  auto out = codec::error_bounds(allowed.depth_pixels, 1 / std::max(camera.focal_x(), camera.focal_y()), allowed.normal,
                                 allowed.colour);
  if (const int below = std::bit_width(out.depth) - kBits; below > 0) out.depth = out.depth >> below << below;
  return out;
}

enum class Redundancy {
  kEliminate,  ///< T4.3.1: only what the model does not show yet is packed
  kKeep,       ///< everything is packed; viewers choose the best patch per cluster (T4.4.3)
};

struct Config {
  points::ModelConfig model;
  Redundancy redundancy = Redundancy::kEliminate;
  float relative_epsilon = 0.004f;               ///< of T4.3.1, as a fraction of the depth
  float nearest_sample = splat::kNearestSample;  ///< pixels: of splat::eliminate_redundancy
  /// Clusters that nobody drew for longer are forgotten; 0: never (T4.3.3).
  double obsolete_after_s = 0;
  /// Above it the least recently drawn clusters are forgotten, down to 90 % of it; 0: no limit.
  uint64_t max_points = 0;
  /// Bytes of the patches kept for events_since(). Above it those least recently drawn are forgotten with their
  /// clusters, down to 90 % of it; 0: no limit.
  uint64_t max_log_bytes = 0;
  // With kKeep single patches of clusters are forgotten instead, highest score first (obsolescence.h); the three
  // limits above are then about patches.
  uint32_t patches_per_cluster = 6;  ///< at most; 0: no limit
  int threads = 1;                   ///< for reference depth maps; 0: all cores
};

struct Statistics {
  uint64_t tiles = 0;              ///< packed
  uint64_t tiles_untold = 0;       ///< of these, told nobody: Event::is_told()
  uint64_t tiles_duplicate = 0;    ///< dropped: had that tile of that frame already
  uint64_t tiles_other_epoch = 0;  ///< dropped: sampled from another version of the data set
  uint64_t tiles_refused = 0;      ///< dropped: contradict themselves or their frame
  uint64_t frames_complete = 0;
  uint64_t samples = 0, kept = 0;  ///< covered pixels before and after elimination
  uint64_t points_outside = 0;     ///< kept samples outside the octree's cube
  uint64_t clusters_forgotten = 0, patches_forgotten = 0, points_forgotten = 0;
  uint64_t patches_bounded = 0, patches_refined = 0;  ///< packed with an error; exact now
  uint64_t bytes_refined = 0;                         ///< what that took
};

class PackerCore {
 public:
  /// The two steps of redundancy elimination; tests replace them.
  struct Hooks {
    std::function<void(const points::PointModel&, const geometry::Camera&, int threads, std::vector<float>& depth_m)>
        reference_depth = splat::render_reference_depth;
    std::function<splat::Elimination(const geometry::Camera&, const geometry::Rect&,
                                     const std::vector<float>& reference_depth_m, float relative_epsilon,
                                     image::DepthImage&, float nearest)>
        eliminate = splat::eliminate_redundancy;
  };

  /// Preconditions: points::validate(config.model); mosaics are not merged (model.compact) with kKeep. Sequences start
  /// at 1.
  PackerCore(const Config& config, EpochId epoch);
  PackerCore(const Config& config, EpochId epoch, Hooks hooks);
  ~PackerCore();

  /// Packs a tile: eliminates what the model shows, inserts the rest, returns the event to publish. A tile of which
  /// nothing is left is an event too: it is told (of no points) if it completes a frame. Nothing: the
  /// tile was dropped and counted (duplicate, other epoch). Error: camera, rectangle, image or frame do not fit
  /// together; dropped and counted. now_s: any steady clock; the same one in all calls.
  ///   stream: codec stream of the tile's image, or null. Where everything is kept it is published as it is; otherwise,
  ///   or if it is null, the tile is encoded.
  ///   publish: called with the event as soon as it is known, while the model has yet to take the points over, so that
  ///   those who wait for them need not wait for that too; or null.
  ///   reference: what the model shows at the tile, or nothing: then it is rendered.
  Result<std::optional<Event>> submit(SampledTile tile, double now_s,
                                      std::shared_ptr<const std::vector<uint8_t>> stream = {},
                                      const std::function<void(const Event&)>& publish = {},
                                      const std::optional<KnownReference>& reference = {});

  /// What comes from now on may differ by so much from what was sampled, in the model and in its replicas.
  void allow_errors(const AllowedErrors& allowed);
  const AllowedErrors& allowed_errors() const;
  /// Makes the newest patch exact that is not yet, of those that were drawn since `drawn_since_s`: the event to
  /// publish. Nothing: there is none, or it was packed too long ago (refinement::RefinableBook).
  std::optional<Event> refine(double drawn_since_s);

  /// True if that tile of that frame was packed already, as far back as is remembered: frame_book.h.
  bool has(FrameId frame, uint32_t tile) const;

  /// A viewer drew these clusters: from each one the patch with that frame tag, or all of its patches if `frames` is
  /// empty. Unknown keys are ignored. Precondition: no frames, or as many as clusters.
  void accessed(std::span<const points::ClusterKey> clusters, double now_s, std::span<const uint32_t> frames = {});

  /// A frame of which nothing is sampled is complete: the event of no points that says so to viewers. frame: its label;
  /// it stands for one tile. Else as submit().
  Result<std::optional<Event>> complete_empty(FramePart frame, double now_s);

  /// No more tiles of a frame come: the event of no points that says so to viewers, with the number of tiles that are
  /// left out. frame: its label, with the number of its tiles. Nothing also where all of them were packed. Else as
  /// submit().
  Result<std::optional<Event>> end_frame(FramePart frame, double now_s);

  /// Tells everything that happens to the model from now on. watcher: null: nobody; it must outlive its use here.
  void watch(ModelWatcher* watcher);

  /// Drops clusters, for whatever reason. Returns the events to publish.
  std::vector<Event> forget(std::span<const points::ClusterKey> clusters);

  /// Decides what is obsolete (T4.3.3) or too much. Returns the forget events to publish, most often none.
  std::vector<Event> tick(double now_s);

  /// The forget events for the coarse passes of frames that were completed since the last call: a complete frame
  /// has every sample of its coarse pass, whose patches would only be in the way of choosing the best ones.
  std::vector<Event> forget_superseded();

  /// Frames are numbered anew from here: the tiles that came so far are of other frames.
  void forget_frames();

  /// A new version of the data set: forgets everything. Nothing if that is the epoch already.
  std::optional<Event> begin_epoch(EpochId epoch);

  /// What brings a replica that has applied every event up to `after` (0: an empty one) to the present state, in order
  /// of sequence. Patches of which every point is forgotten are left out, as are forgets that change nothing for anyone
  /// who applies this list; so sequences rise but may have holes. A replica that has applied the list is as of
  /// sequence(). Precondition: remembers(after).
  std::vector<Event> events_since(Sequence after) const;
  /// The same event by event, as of now.
  EventLog::Replay replay(Sequence after) const;
  std::optional<Event> next(EventLog::Replay& replay) const;
  /// False: it is not known any more what a replica as of `after` would have to forget. It must start anew, from 0.
  bool remembers(Sequence after) const;

  /// The newest event's; 0 before the first.
  Sequence sequence() const;
  EpochId epoch() const;
  Redundancy redundancy() const;
  const points::PointModel& model() const;
  const Statistics& statistics() const;
  /// Memory of the events kept for events_since(), estimated. Forgets kept are at most as many as leaves were ever
  /// touched.
  uint64_t log_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::packer
