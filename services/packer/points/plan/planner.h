// Finds the rays of a view that the model lacks: sampling is steered by it. No sockets, no clocks: requests and sampled
// tiles come in, plans come out. One thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/core/ids.h"
#include "common/points/point_model.h"
#include "common/wire/tile_messages.h"
#include "services/packer/points/event.h"
#include "services/packer/points/plan/known_empty.h"
#include "services/packer/points/plan/planned_frame.h"
#include "services/packer/points/plan/validation.h"

namespace telesplat::packer {

// Reasons to cast a pixel of a view, or not to.

enum class RayClass : uint8_t { kNothing, kUnproven, kSparse, kEdge, kStale, kValidation, kGood, kKnownEmpty };
inline constexpr int kRayClasses = 8;

/// Names as in figures of plans: "nothing", "known_empty".
inline const char* name_of(RayClass c) {
  constexpr std::array<const char*, kRayClasses> kNames{"nothing", "unproven",   "sparse", "edge",
                                                        "stale",   "validation", "good",   "known_empty"};
  return kNames[static_cast<size_t>(c)];
}

struct PlanConfig {
  points::ModelConfig model;
  float relative_epsilon = 0.004f;  ///< Config::relative_epsilon
  float nearest_sample = 0.6f;      ///< Config::nearest_sample
  double view_cell_m = 0.2;         ///< a head movement this long shall uncover nothing unknown; 0: no rays from beside
  int validation = 32;              ///< every good pixel is cast once in this many plans of a view; 0: never
  int still_rays = 16;              ///< rays per pixel everywhere while the head stands still: 1, 4 or 16
  uint64_t max_points = 0;          ///< the model's limit: near it no extra rays are planned; 0: no limit
  int threads = 1;                  ///< 0: all cores
  bool operator==(const PlanConfig&) const = default;
};

class Planner final : public ModelWatcher {
 public:
  /// Precondition: points::validate(config.model).
  explicit Planner(const PlanConfig& config);

  /// Learns the points that a model holds already.
  void learn(const points::PointModel& model) { known_empty_.add(model); }

  /// Plans a view, or rays beyond it (request.extra): returns tiles of the rays that the model lacks.
  ///   model: as of the event `sequence`; the same one in all calls, and of request.epoch. The planner watches it
  ///   (PackerCore::watch).
  ///   now_s: any steady clock; the same one in all calls.
  /// Numbers in the request may come from outside: invalid ones give a plan without tiles, or a full one.
  wire::Plan plan(const points::PointModel& model, Sequence sequence, const wire::PlanRequest& request, double now_s);
  /// The same in pieces, so that others can be answered in between: where little is left to find beyond a view,
  /// searching takes seconds. nullopt: kPiecePixels or a little more were searched for extra rays, and fewer found than
  /// the plan may have; a call with the same request goes on from there.
  std::optional<wire::Plan> plan_piece(const points::PointModel& model, Sequence sequence,
                                       const wire::PlanRequest& request, double now_s);

  static constexpr uint64_t kMaxPixels = uint64_t{1} << 23;  ///< larger views are cast whole
  static constexpr uint64_t kPiecePixels = uint64_t{1} << 20;

  /// Takes a frame's sampled tile, before elimination and before its points are inserted. Its frame may be planned or
  /// not: from a frame that is not known (any more) the planner learns only certain facts.
  void take(const SampledTile& tile, bool whole, double now_s);
  /// No more tiles of this frame come: it counts as complete.
  void end_frame(FrameId id);
  /// Returns the model as seen where a planned tile was cast, as of now: PackerCore::submit() then need not render it.
  /// nullopt: not known. Valid until the planner or the model changes.
  std::optional<KnownReference> reference(const SampledTile& tile);
  /// Returns the rays of a planned tile. Null: its plan is not known (any more), or the tile has samples beside them.
  /// Valid until the planner changes.
  const image::PixelMask* cast(const SampledTile& tile);
  /// Returns the rays of a tile finer than a view that met nothing, as large as the tile. Empty: the tile is not of
  /// that kind, or its plan is no longer known.
  image::PixelMask missed(const SampledTile& tile);
  /// Learns the empty space of one complete frame, and drops it. False: no frame is complete. To be called in spare
  /// time, after the frame's points are inserted; plan() does the same for frames that have waited long.
  bool settle();
  /// True if settle() should not wait: else a view's rays into empty space are cast again.
  bool settles_soon() const { return tells_much(shelf_); }
  /// Planned frames that are not forgotten yet: their maps are most of the planner's memory.
  size_t frames() const { return shelf_.frames().size(); }

  /// True if a view was planned, or began to come, a moment ago, and is not complete.
  bool view_under_way(double now_s) const { return packer::view_under_way(shelf_, now_s); }

  /// Returns the clusters that rays since the last call have disproved: their points are to be forgotten. Ascending.
  std::vector<points::ClusterKey> disproved() { return validation_.disproved(); }

  /// Frames are numbered anew from here.
  void forget_frames() { shelf_.clear(); }

  void inserted(const points::PreparedPatch& patch) override;
  void forgotten(std::span<const points::ClusterKey> clusters) override;
  void cleared() override;

 private:
  /// A request, with the plan that answers it.
  struct Question {
    const points::PointModel& model;
    Sequence sequence;
    const wire::PlanRequest& request;
    double now_s;
    wire::Plan plan{};

    TileLimits limits() const { return {static_cast<int>(request.tile_size), request.tile_rays}; }
    /// Extra rays of this plan, at most.
    uint64_t most_rays = ~uint64_t{0};
    bool enough(uint64_t rays) const { return rays >= most_rays; }

    /// Extra rays are searched for in pieces: pixels that this piece has searched, and whether it broke off.
    uint64_t looked_at = 0;
    bool unfinished = false;
    void look_at(const geometry::Camera& camera) { looked_at += uint64_t(camera.width) * uint64_t(camera.height); }
    /// To be asked while pixels are left to be searched: true ends the piece. Searched pixels are not searched again.
    bool breaks_off() { return unfinished = looked_at >= Planner::kPiecePixels; }
  };

  std::shared_ptr<ViewMap> new_map();

  // planner.cpp: views.
  void plan_view(Question& q, ViewerView& view);
  void map_view(Question& q, ViewerView& view);
  struct ViewClasses;
  uint64_t validation_sets(const Question& q, ViewerView& view) const;
  ViewClasses classify(Question& q, ViewerView& view);
  void put_off(uint64_t most_rays, ViewClasses& classes);
  void plan_full(Question& q, const ViewerView& view);

  // extra_rays.cpp: rays beyond a view.
  void plan_extra(Question& q, ViewerView& view);
  bool plan_lost(Question& q, ViewerView& view);
  double step_aside_m(const ViewerView& view) const;
  bool plan_cell(Question& q, ViewerView& view, unsigned direction);
  bool plan_cells(Question& q, ViewerView& view);
  bool plan_fine(Question& q, ViewerView& view);
  void look_closer(Question& q, ViewerView& view);
  bool plan_stages(Question& q, ViewerView& view);
  /// Pixels that shall have 2^finer rays on each axis; all: also where the model has samples. number: the stage's.
  struct FineStage {
    size_t number;
    const image::PixelMask& wanted;
    int finer;
    bool all;
  };
  bool plan_fine(Question& q, ViewerView& view, const FineStage& stage);
  /// Pixels of a view that have not had such rays; the pixels searched since, and the tiles found there.
  struct FineSearch {
    geometry::Camera camera;  ///< the finer view's
    bool all;                 ///< rays are wanted also where the model has samples
    image::PixelMask open;
    image::PixelMask& refined;
    std::vector<RayTile>& tiles;
    uint64_t rays = 0;  ///< number of rays in `tiles`
  };
  void look_into(Question& q, const geometry::Rect& region, FineSearch& search);

  /// Puts the tiles into the plan and the frame on the shelf. Tiles beyond a message's limit are left out. Returns the
  /// number of tiles.
  size_t issue(Question& q, std::vector<RayTile> tiles, PlannedFrame frame);

  // take_tile.cpp: planned tiles come back.
  void take_whole(const SampledTile& tile, double now_s);
  void take_planned(PlannedFrame& frame, const SampledTile& tile, double now_s);
  void note_done(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask* cast);
  void refill_empty(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask& contradicted);
  void settle(const PlannedFrame& frame);
  void carve(const geometry::Camera& full, const std::vector<float>& all_m);
  void settle_old(double now_s);

  const PlanConfig config_;
  const PixelTest test_;
  splat::ViewKeys keys_;
  KnownEmpty known_empty_;
  BlueNoise blue_noise_;
  Validation validation_;
  ViewerViews viewers_;
  FrameShelf shelf_;
  std::vector<std::shared_ptr<ViewMap>> maps_;  // kept for their memory; some are in use
  std::vector<float> clear_m_, coarse_m_;       // kept for their memory
  uint64_t changes_ = 0;                        // counts changes of the model, except patches that brought no points
};

}  // namespace telesplat::packer
