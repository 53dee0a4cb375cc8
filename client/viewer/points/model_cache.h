// The viewer's replica of the point model, shared by the worker that applies events and the display thread that draws.
// Events are prepared and merged without the lock and committed under it in microseconds. Dropped parts are freed by
// the worker, after the frame that may draw them.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/points/point_model.h"
#include "common/points/refinement.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Log of what was drawn: distinct clusters, or, if packing keeps redundant patches, distinct patches of clusters.
class AccessLog {
 public:
  /// Entries of one report at most: well below the size of a message.
  static constexpr size_t kMaxInReport = 1u << 16;

  /// Adds what a frame drew; `frames` is empty (whole clusters) or as long as `clusters` (frame tags of patches). A
  /// change from one to the other empties the log. Cheap enough for the display thread.
  void add(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames);

  /// The fields of wire::AccessReport.
  struct Report {
    std::vector<uint32_t> clusters, frames;
  };
  /// Returns all entries since the last call, once each, in ascending order of cluster and frame tag; may be empty.
  std::vector<Report> reports();

 private:
  std::vector<uint64_t> seen_;  // upper half: cluster, lower half: frame tag
  bool with_frames_ = false;
};

class ModelCache {
 public:
  // ---- worker ----
  /// Begins an empty replica, for another packer's model or a new epoch; epoch 0: not known yet. The replica on display
  /// stays until show_newest(), unless it is empty; a newer one that was not shown is dropped. Returns true if an older
  /// one stays.
  bool begin_replica(const points::ModelConfig& config, EpochId epoch = {}, Sequence applied = {});
  bool has_replica() const { return newest_.model != nullptr; }
  const points::ModelConfig& config() const { return newest_.model->config(); }
  /// Epoch of the newest replica; 0: not known yet.
  EpochId epoch() const { return newest_.epoch; }
  /// Precondition: `epoch` is the newest replica's, or that one is not known yet. Only one thread at a time may change
  /// the cache: mosaics are merged while the display draws.
  void insert(points::PreparedPatch patch, EpochId epoch);
  /// Likewise, for patches that are in the newest replica.
  void refine(const points::PreparedRefinement& refinement);
  /// frames: empty, or one for each key: then only the mosaics with that frame tag go (PointModel::forget).
  void forget(Sequence sequence, std::span<const points::ClusterKey> keys, std::span<const uint32_t> frames = {});
  /// Replaces the older replica on display by the newest. No effect if it is displayed already.
  void show_newest();
  /// Frees dropped parts that no frame draws any more. To be called often: to free a million points takes milliseconds.
  void free_dropped();
  /// Makes up to `most` of the summaries that the display asked for (points/summary.h), while it draws. Precondition:
  /// no other thread changes the cache. Returns the bricks whose summaries were made, in order.
  std::vector<points::ClusterKey> summarise(size_t most);
  /// Summaries made so far, and changes of the base.
  uint64_t summaries_made() const { return summaries_made_; }
  /// Draws this base from now on; null: none. False: it is the one that is drawn, or still none.
  bool set_base(std::shared_ptr<const splat::BaseMesh> base);
  /// From where the newest picture shows the base; nothing before the first one.
  std::optional<splat::Viewpoint> viewpoint() const {
    const std::lock_guard lock(mutex_);
    return base_.from;
  }
  /// Digest of the newest replica; 0: there is no replica. The display may draw meanwhile: it changes no points.
  uint64_t digest() const;

  // ---- display thread ----
  /// Selects from the replica on display. The list stays drawable until end_frame(), also after further selections.
  void select(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  /// The same for a part of the picture that is drawn more finely; it requests no summaries.
  void select_part(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  void end_frame();

  /// Places where points came or went.
  struct Changes {
    bool any = false;                  ///< an event came, even if without points
    bool everywhere = false;           ///< another replica is on display, or there are more than kMostChanges boxes
    std::vector<geometry::Box> boxes;  ///< room space: clusters and bricks whose points changed; may repeat
  };
  /// Takes the changes since the last call. Later selections may have more changes: the next call returns those.
  void take_changes(Changes& out);

  // ---- any thread ----
  struct Figures {
    uint64_t points = 0, bytes = 0;  ///< the newest replica; bytes include its summaries
    uint64_t points_displayed = 0;   ///< in the replica on display
    uint64_t patches = 0;            ///< inserted so far
  };
  Figures figures() const;

 private:
  struct Replica {
    std::unique_ptr<points::PointModel> model;
    EpochId epoch;
    Sequence applied;     // newest event
    uint64_t number = 0;  // counts all replicas that this cache had
    points::Summaries summaries;
    uint64_t summary_bytes = 0;  // bytes of `summaries`
  };
  struct Dropped {
    std::vector<std::unique_ptr<points::Cluster>>
        clusters;                         // removed clusters and parts of clusters: draw lists point to them
    std::vector<points::Mosaic> mosaics;  // merged into others
    std::vector<std::unique_ptr<points::Summary>> summaries;
    std::vector<std::unique_ptr<points::PointModel>> models;
  };
  const Replica& displayed() const { return older_.model ? older_ : newest_; }
  // Returns the place for removed parts of a model: if the frame at hand draws the model, they wait for its end.
  Dropped& dropped_of(const points::PointModel* model) { return model == drawn_ ? parked_ : free_; }
  void drop(Replica& replica);
  void select_displayed(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  void commit(points::Insertion insertion);  // mutex_ is held
  void note_change(points::ClusterKey key);
  void note_change(const geometry::Box& box);
  void note_replica();

  mutable std::mutex mutex_;
  Replica newest_, older_;  // older_ is set only while it is on display instead of the newest
  const points::PointModel* drawn_ = nullptr;
  splat::ShownBase base_;
  Dropped parked_, free_;
  uint64_t replicas_ = 0, patches_ = 0, summaries_made_ = 0;
  std::vector<points::ClusterKey> wanted_;  // requested summaries of the newest replica
  Changes changes_;
};

}  // namespace telesplat::viewer
