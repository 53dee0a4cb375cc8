// The viewer's replica of the point model, shared by the worker that applies events and the display thread that draws. Events are
// prepared without the lock and committed under it in microseconds; what a frame in progress may still draw is freed after it.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "common/points/point_model.h"
#include "common/splat/view_selection.h"

namespace telesplat::viewer {

class ModelCache {
 public:
  // ---- worker ----
  /// Starts an empty replica. An older one, if any, is shown until show_newest() is called.
  void begin_replica(const points::ModelConfig& config);
  bool has_replica() const { return newest_ != nullptr; }
  const points::ModelConfig& config() const { return newest_->config(); }
  void insert(points::PreparedPatch patch);
  /// frames: empty, or one a key: then only the mosaics with that frame tag (PointModel::forget).
  void forget(Sequence sequence, std::span<const points::ClusterKey> keys, std::span<const uint32_t> frames = {});
  void clear(Sequence sequence);
  /// Replaces the older replica on display by the newest. No effect if it is displayed already.
  void show_newest();
  /// Digest of the newest replica, for tests of replication.
  uint64_t digest() const;

  // ---- display thread ----
  /// Selects what to draw of the replica on display. The list stays drawable until end_frame().
  void select(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out);
  void end_frame();

  // ---- any thread ----
  struct Figures {
    uint64_t points = 0, bytes = 0, patches = 0;
  };
  Figures figures() const;

 private:
  mutable std::mutex mutex_;
  std::unique_ptr<points::PointModel> newest_, shown_;  // shown_ only while it is not the newest
  std::vector<std::unique_ptr<points::Cluster>>
      retired_clusters_;  // where they were, or what was dropped of them: draw lists point to them
  std::vector<std::unique_ptr<points::PointModel>> retired_models_;
  Sequence applied_, applied_shown_;  // newest events of newest_ and shown_
  uint64_t patches_ = 0;
};

}  // namespace telesplat::viewer
