// The viewer's replica of the point model, shared by the worker that applies events and the display thread that draws.
// Events are prepared and merged without the lock and committed under it in microseconds. What is dropped is freed by
// the worker, and not before the frame that may draw it is finished.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "common/points/point_model.h"
#include "common/points/refinement.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Distinct clusters, or, where packing keeps redundant patches, distinct patches of clusters.
class AccessLog {
 public:
  /// Entries of one report: well below the size of a message.
  static constexpr size_t kMaxInReport = 1u << 16;

  /// What a frame drew; `frames` is empty (whole clusters) or as long as `clusters` (frame tags of patches). Whoever
  /// changes from one to the other begins anew. Cheap: for the display thread.
  void add(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames);

  /// The fields of wire::AccessReport.
  struct Report {
    std::vector<uint32_t> clusters, frames;
  };
  /// Everything added since the last call, once each, in ascending order of cluster and frame tag; empty if nothing
  /// was.
  std::vector<Report> reports();

 private:
  std::vector<uint64_t> seen_;  // cluster << 32 | frame tag, as it came
  bool with_frames_ = false;
};

class ModelCache {
 public:
  // ---- worker ----
  /// Starts an empty replica, of another packer's model or of a new epoch; epoch 0: not known yet. What is on display
  /// stays there until show_newest(), unless it is empty; a newer one that was not shown is dropped. Returns whether an
  /// older one stays.
  bool begin_replica(const points::ModelConfig& config, EpochId epoch = {}, Sequence applied = {});
  bool has_replica() const { return newest_.model != nullptr; }
  const points::ModelConfig& config() const { return newest_.model->config(); }
  /// The newest replica's; 0: not known yet.
  EpochId epoch() const { return newest_.epoch; }
  /// Precondition: `epoch` is the newest replica's, or that is not known yet. Only one thread at a time may change the
  /// cache: mosaics are merged while the display draws.
  void insert(points::PreparedPatch patch, EpochId epoch);
  /// Likewise, of patches that are in the newest replica.
  void refine(const points::PreparedRefinement& refinement);
  /// frames: empty, or one a key: then only the mosaics with that frame tag (PointModel::forget).
  void forget(Sequence sequence, std::span<const points::ClusterKey> keys, std::span<const uint32_t> frames = {});
  /// Replaces the older replica on display by the newest. No effect if it is displayed already.
  void show_newest();
  /// Frees what was dropped and no frame draws any more. To be called often: to free a million points takes
  /// milliseconds.
  void free_dropped();
  /// Makes up to `most` of the summaries that the display asked for (points/summary.h), while it draws. Only where no
  /// other thread changes the cache. Returns the bricks whose summaries were made, in order.
  std::vector<points::ClusterKey> summarise(size_t most);
  /// Summaries made so far.
  uint64_t summaries_made() const { return summaries_made_; }
  /// Digest of the newest replica; 0: there is none. The display draws meanwhile: it changes no points.
  uint64_t digest() const;

  // ---- display thread ----
  /// Selects what to draw of the replica on display. The list stays drawable until end_frame(), also if more is
  /// selected before that.
  void select(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  /// The same for a part of the picture that is drawn more finely: what summaries it would like makes none.
  void select_part(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  void end_frame();

  /// Where points came or went.
  struct Changes {
    bool any = false;                  ///< something happened, if only an event without points
    bool everywhere = false;           ///< another replica is on display, or too much changed to tell
    std::vector<geometry::Box> boxes;  ///< room space: clusters and bricks whose points changed; may repeat themselves
  };
  /// What happened since the last call. What is selected later may have more changes: the next call tells them.
  void take_changes(Changes& out);

  // ---- any thread ----
  struct Figures {
    uint64_t points = 0, bytes = 0;  ///< of the newest replica; bytes with its summaries
    uint64_t points_displayed = 0;   ///< of the one on display
    uint64_t patches = 0;            ///< inserted so far
  };
  Figures figures() const;

 private:
  struct Replica {
    std::unique_ptr<points::PointModel> model;
    EpochId epoch;
    Sequence applied;     // newest event
    uint64_t number = 0;  // of all replicas this cache had
    points::Summaries summaries;
    uint64_t summary_bytes = 0;  // of them
  };
  struct Dropped {
    std::vector<std::unique_ptr<points::Cluster>>
        clusters;                         // where they were, or what was dropped of them: draw lists point to it
    std::vector<points::Mosaic> mosaics;  // merged into others
    std::vector<std::unique_ptr<points::Summary>> summaries;
    std::vector<std::unique_ptr<points::PointModel>> models;
  };
  const Replica& displayed() const { return older_.model ? older_ : newest_; }
  // Where to put what was part of a model: it waits for the end of the frame if that frame draws the model.
  Dropped& dropped_of(const points::PointModel* model) { return model == drawn_ ? parked_ : free_; }
  void drop(Replica& replica);
  void select_displayed(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  void commit(points::Insertion insertion);  // mutex_ is held
  void note_change(points::ClusterKey key);
  void note_change(const geometry::Box& box);
  void note_replica();

  mutable std::mutex mutex_;
  Replica newest_, older_;  // older_ only while it is on display in place of the newest
  const points::PointModel* drawn_ = nullptr;
  Dropped parked_, free_;
  uint64_t replicas_ = 0, patches_ = 0, summaries_made_ = 0;
  std::vector<points::ClusterKey> wanted_;  // summaries of the newest replica
  Changes changes_;
};

}  // namespace telesplat::viewer
