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

// Allowed differences of published points from sampled ones, in the units of the command line.

struct AllowedErrors {
  double depth_pixels = 0;  ///< as a fraction of a pixel's footprint at that depth, along the line of sight; 0: exact
  int normal = 0;           ///< steps of the octahedral map, in each coordinate
  int colour = 0;           ///< in each channel, of 255

  bool exact() const { return depth_pixels <= 0 && normal <= 0 && colour <= 0; }
  bool operator==(const AllowedErrors&) const = default;
};

/// Converts these limits for a camera, by the finer of its pixel axes. Frusta are wider the faster a head moves: depth
/// bounds are rounded down to one of 16 per octave, so that coders, which keep tables by bound, reuse them.
inline codec::ErrorBounds bounds_of(const AllowedErrors& allowed, const geometry::Camera& camera) {
  if (allowed.exact()) return {};
  constexpr int kBits = 5;
  auto out = codec::error_bounds(allowed.depth_pixels, 1 / std::max(camera.focal_x(), camera.focal_y()), allowed.normal,
                                 allowed.colour);
  if (const int below = std::bit_width(out.depth) - kBits; below > 0) out.depth = out.depth >> below << below;
  return out;
}

enum class Redundancy {
  kEliminate,  ///< T4.3.1: only samples that the model does not show yet are packed
  kKeep,       ///< all samples are packed; viewers choose the best patch per cluster (T4.4.3)
};

struct Config {
  points::ModelConfig model;
  Redundancy redundancy = Redundancy::kEliminate;
  float relative_epsilon = 0.004f;               ///< T4.3.1's tolerance, as a fraction of the depth
  float nearest_sample = splat::kNearestSample;  ///< pixels, for splat::eliminate_redundancy
  /// Clusters that no viewer drew for longer are forgotten; 0: never (T4.3.3).
  double obsolete_after_s = 0;
  /// Above it the least recently drawn clusters are forgotten, until at most 90 % of it are left; 0: no limit.
  uint64_t max_points = 0;
  /// Bytes of the patches kept for events_since(). Above it those least recently drawn are forgotten with their
  /// clusters, until at most 90 % of it are left; 0: no limit.
  uint64_t max_log_bytes = 0;
  // With kKeep, single patches of clusters are forgotten, highest score first (obsolescence.h); the three limits above
  // then apply to patches.
  uint32_t patches_per_cluster = 6;  ///< at most; 0: no limit
  int threads = 1;                   ///< for reference depth maps; 0: all cores
};

struct Statistics {
  uint64_t tiles = 0;              ///< packed
  uint64_t tiles_untold = 0;       ///< packed, but not published: !Event::is_told()
  uint64_t tiles_duplicate = 0;    ///< dropped: that tile of that frame was packed already
  uint64_t tiles_other_epoch = 0;  ///< dropped: sampled from another version of the data set
  uint64_t tiles_refused = 0;      ///< dropped: they contradict themselves or their frame
  uint64_t frames_complete = 0;
  uint64_t samples = 0, kept = 0;  ///< covered pixels before and after elimination
  uint64_t points_outside = 0;     ///< kept samples outside the octree's cube
  uint64_t clusters_forgotten = 0, patches_forgotten = 0, points_forgotten = 0;
  uint64_t patches_bounded = 0, patches_refined = 0;  ///< packed with an error; made exact since
  uint64_t bytes_refined = 0;                         ///< bytes of the refinements
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

  /// Packs a tile: eliminates the samples that the model shows, inserts the rest, returns the event to publish. A tile
  /// without remaining samples makes an event too: it is published, without points, if it completes a frame. nullopt:
  /// the tile was dropped and counted (duplicate, other epoch). Error: camera, rectangle, image or frame do not fit
  /// together; the tile was dropped and counted. now_s: any steady clock; the same one in all calls.
  ///     stream: codec stream of the tile's image, or null. Where all samples are kept it is published unchanged;
  /// otherwise the tile is encoded anew.
  ///     publish: called, unless empty, with the event as soon as it is known, before the model takes the points over:
  /// viewers wait for the event, not for the model.
  ///     reference: the model as seen at the tile; nullopt: submit() renders it.
  Result<std::optional<Event>> submit(SampledTile tile, double now_s,
                                      std::shared_ptr<const std::vector<uint8_t>> stream = {},
                                      const std::function<void(const Event&)>& publish = {},
                                      const std::optional<KnownReference>& reference = {});

  /// From now on published points may differ from sampled ones by this much, in the model and in its replicas.
  void allow_errors(const AllowedErrors& allowed);
  const AllowedErrors& allowed_errors() const;
  /// Makes the newest inexact patch exact among those drawn since `drawn_since_s`. Returns the event to publish.
  /// nullopt: no such patch, or it was packed too long ago (refinement::RefinableBook).
  std::optional<Event> refine(double drawn_since_s);

  /// True if that tile of that frame was packed already, as far back as frame_book.h remembers.
  bool has(FrameId frame, uint32_t tile) const;

  /// A viewer drew these clusters: from each one the patch with that frame tag, or all of its patches if `frames` is
  /// empty. Unknown keys are ignored. Precondition: `frames` is empty or as long as `clusters`.
  void accessed(std::span<const points::ClusterKey> clusters, double now_s, std::span<const uint32_t> frames = {});

  /// Completes a frame that needs no samples. Returns the event without points that announces this to viewers. frame:
  /// its label; it counts as one tile. Otherwise as submit().
  Result<std::optional<Event>> complete_empty(FramePart frame, double now_s);

  /// No more tiles of a frame come. Returns the event without points that announces this to viewers, with the number of
  /// tiles left out. frame: its label, with the number of its tiles. Also nullopt if all tiles were packed. Otherwise
  /// as submit().
  Result<std::optional<Event>> end_frame(FramePart frame, double now_s);

  /// Reports every change of the model to `watcher` from now on. Null: to no watcher. It must outlive this use.
  void watch(ModelWatcher* watcher);

  /// Drops clusters. Returns the events to publish.
  std::vector<Event> forget(std::span<const points::ClusterKey> clusters);

  /// Forgets what is obsolete (T4.3.3) or beyond the limits. Returns the forget events to publish, most often none.
  std::vector<Event> tick(double now_s);

  /// Returns the forget events for the coarse passes of frames completed since the last call: a complete frame has
  /// every sample of its coarse pass, whose patches would only hinder the choice of the best ones.
  std::vector<Event> forget_superseded();

  /// Frames are numbered anew from here: earlier tiles belong to other frames.
  void forget_frames();

  /// A new version of the data set: forgets everything. nullopt: the epoch is current already.
  std::optional<Event> begin_epoch(EpochId epoch);

  /// Returns the events that bring a replica with every event up to `after` (0: an empty one) to the present state, in
  /// order of sequence. Left out: patches whose every point is forgotten, and forgets that change nothing in this list.
  /// So sequences rise but may have gaps. After the list a replica is as of sequence(). Precondition: remembers(after).
  std::vector<Event> events_since(Sequence after) const;
  /// The same event by event, as of now.
  EventLog::Replay replay(Sequence after) const;
  std::optional<Event> next(EventLog::Replay& replay) const;
  /// False: the packer no longer knows all that a replica as of `after` must forget. It must start anew, from 0.
  bool remembers(Sequence after) const;

  /// Sequence of the newest event; 0 before the first.
  Sequence sequence() const;
  EpochId epoch() const;
  Redundancy redundancy() const;
  const points::PointModel& model() const;
  const Statistics& statistics() const;
  /// Estimated memory of the events kept for events_since(). It keeps at most one forget per leaf ever touched.
  uint64_t log_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::packer
