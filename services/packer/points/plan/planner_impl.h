// The planner's parts: views, extra rays, what comes back.
#pragma once

#include <optional>

#include "services/packer/points/plan/blue_noise.h"
#include "services/packer/points/plan/known_empty.h"
#include "services/packer/points/plan/planner.h"
#include "services/packer/points/plan/validation.h"
#include "services/packer/points/plan/viewer_views.h"

namespace telesplat::packer {

struct Planner::Impl {
  explicit Impl(const PlanConfig& config);

  /// One question, and what answers it.
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

    /// Extra rays are looked for in pieces: pixels that this one has looked at, and whether it broke off.
    uint64_t looked_at = 0;
    bool unfinished = false;
    void look_at(const geometry::Camera& camera) { looked_at += uint64_t(camera.width) * uint64_t(camera.height); }
    /// To be asked where more is left to be looked at: true ends the piece. What was looked at is not again.
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
  /// Pixels that shall have 2^finer rays a side; all: also where the model has samples. number: of the stage.
  struct FineStage {
    size_t number;
    const image::PixelMask& wanted;
    int finer;
    bool all;
  };
  bool plan_fine(Question& q, ViewerView& view, const FineStage& stage);
  /// Pixels of a view that have not had such rays; what was looked at, and found there.
  struct FineSearch {
    geometry::Camera camera;  ///< of the finer view
    bool all;                 ///< rays are wanted wherever the model has samples, too
    image::PixelMask open;
    image::PixelMask& refined;
    std::vector<RayTile>& tiles;
    uint64_t rays = 0;  ///< of the tiles
  };
  void look_into(Question& q, const geometry::Rect& region, FineSearch& search);

  /// Puts the tiles into the plan and on the shelf. Those that a message does not hold are left out. Returns their
  /// number.
  size_t issue(Question& q, std::vector<RayTile> tiles, PlannedFrame frame);

  // planned tiles come back: take_tile.cpp
  void take(const SampledTile& tile, bool whole, double now_s);
  void end_frame(FrameId id);
  std::optional<KnownReference> reference(const SampledTile& tile);
  image::PixelMask missed(const SampledTile& tile);
  void take_whole(const SampledTile& tile, double now_s);
  void take_planned(PlannedFrame& frame, const SampledTile& tile, double now_s);
  void note_done(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask* cast);
  void refill_empty(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask& contradicted);
  bool settle();
  void settle(const PlannedFrame& frame);
  void carve(const geometry::Camera& full, const std::vector<float>& all_m);
  void settle_old(double now_s);

  const PlanConfig config;
  const PixelTest test;
  splat::ViewKeys keys;
  KnownEmpty known_empty;
  BlueNoise blue_noise;
  Validation validation;
  ViewerViews viewers;
  FrameShelf shelf;
  std::vector<std::shared_ptr<ViewMap>> maps;  // kept for their memory, some of them in use
  std::vector<float> clear_m, coarse_m;        // kept for their memory
  uint64_t changes = 0;                        // of the model: patches that brought nothing are none
};

}  // namespace telesplat::packer
