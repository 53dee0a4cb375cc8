// Which rays of a view the model lacks: sampling is steered by it. No sockets, no clocks: requests and sampled tiles
// come in, plans come out. One thread at a time.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/core/ids.h"
#include "common/points/point_model.h"
#include "common/wire/tile_messages.h"
#include "services/packer/points/known_reference.h"
#include "services/packer/points/model_watcher.h"
#include "services/packer/points/plan/ray_class.h"
#include "services/packer/points/sampled_tile.h"

namespace telesplat::packer {

struct PlanConfig {
  points::ModelConfig model;
  float relative_epsilon = 0.004f;  ///< Config::relative_epsilon
  float nearest_sample = 0.6f;      ///< Config::nearest_sample
  double view_cell_m = 0.2;         ///< a head movement this long shall uncover nothing unknown; 0: no such rays
  int validation = 32;              ///< every good pixel is cast once in so many plans of a view; 0: never
  int still_rays = 16;              ///< rays a pixel everywhere while it stands still: 1, 4 or 16
  uint64_t max_points = 0;          ///< of the model: near it no extra rays are planned; 0: no limit
  int threads = 1;                  ///< 0: all cores
  bool operator==(const PlanConfig&) const = default;
};

class Planner final : public ModelWatcher {
 public:
  /// Precondition: points::validate(config.model).
  explicit Planner(const PlanConfig& config);
  ~Planner() override;

  /// What a model holds already.
  void learn(const points::PointModel& model);

  /// The tiles of a view, or of rays beyond it (request.extra): which of its rays the model lacks.
  ///   model: as of the event `sequence`; the same one in all calls, and of request.epoch. The planner watches it
  ///   (PackerCore::watch).
  ///   now_s: any steady clock; the same one in all calls.
  /// Numbers in the request may come from outside: what makes no sense gives a plan without tiles, or a full one.
  wire::Plan plan(const points::PointModel& model, Sequence sequence, const wire::PlanRequest& request, double now_s);
  /// The same in pieces, so that others can be answered in between: what is beyond a view takes seconds to look for
  /// where little is left. nullopt: extra rays were looked for in kPiecePixels or a little more, and fewer found than
  /// the plan may have; the same request goes on from there.
  std::optional<wire::Plan> plan_piece(const points::PointModel& model, Sequence sequence,
                                       const wire::PlanRequest& request, double now_s);

  static constexpr uint64_t kMaxPixels = uint64_t{1} << 23;  ///< larger views are not planned: they are full
  static constexpr uint64_t kPiecePixels = uint64_t{1} << 20;

  /// A tile of a frame as it was sampled, before elimination and before its points are inserted. Whether its frame was
  /// planned or not does not matter: of frames that are not known (any more) only what is certain is learned.
  ///   whole: every pixel of the tile was cast.
  void take(const SampledTile& tile, bool whole, double now_s);
  /// No more tiles of this frame come: what came of it is all that it tells.
  void end_frame(FrameId id);
  /// What the model shows where the tile of a planned frame was cast, as of now: PackerCore::submit() takes it in place
  /// of rendering the model. nullopt: it is not known. Valid until the planner or the model changes.
  std::optional<KnownReference> reference(const SampledTile& tile) const;
  /// Of a tile of rays finer than a view's: those that met nothing, of its size. Empty: it is no such tile, or that is
  /// not known any more.
  image::PixelMask missed(const SampledTile& tile) const;
  /// Learns from a frame that is complete: where nothing is. To be called when there is time, after its points are
  /// inserted, until nothing is left to do (false). plan() does it where it has waited for long.
  bool settle();
  /// settle() should not wait: else a view's rays into empty space are cast again.
  bool settles_soon() const;
  /// Planned, and not forgotten yet: their maps are most of what planning keeps in memory.
  size_t frames() const;

  /// A view was planned, or began to come, a moment ago, and is not complete.
  bool view_under_way(double now_s) const;

  /// What the rays since the last call have disproved: clusters whose points are to be forgotten. Ascending.
  std::vector<points::ClusterKey> disproved();

  /// Frames are numbered anew from here.
  void forget_frames();

  void inserted(const points::PreparedPatch& patch) override;
  void forgotten(std::span<const points::ClusterKey> clusters) override;
  void cleared() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::packer
