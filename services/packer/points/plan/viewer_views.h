// What the planner remembers of each viewer: its last view, and what was cast for it already.
#pragma once

#include <array>
#include <deque>
#include <list>
#include <memory>
#include <span>
#include <vector>

#include "services/packer/points/plan/planned_frame.h"

namespace telesplat::packer {

/// Tiles that were planned and have not come: of frames that the master gave up for a new view.
struct LostTiles {
  geometry::Camera camera;
  PlannedFrame::Kind kind = PlannedFrame::Kind::kFine;
  std::vector<RayTile> tiles;
};

struct ViewerView {
  InstanceId viewer;
  geometry::Camera camera;
  bool known = false;            ///< there was a view
  bool still = false;            ///< the view before was seen by the same camera
  glm::dvec3 movement_m{0};      ///< of the eye since the view before
  std::shared_ptr<ViewMap> map;  ///< of `camera`; null: none
  uint64_t map_changes = 0;      ///< of the model that it shows: Planner::Impl::changes
  image::PixelMask done;         ///< pixels that were cast for this camera
  image::PixelMask doubted;      ///< pixels whose rays have contradicted, from this camera
  uint64_t round = 0;            ///< of validation: sets of pixels that had their turn
  double sets_due = 0, validated_s = -1e9;

  // Extra rays for this camera.
  unsigned cell_turn = 0;                   ///< the direction that is next; goes on from view to view
  unsigned cells_done = 0;                  ///< bit i: nothing is left to be cast from direction i
  std::array<image::PixelMask, 3> refined;  ///< [n]: pixels of the view whose rays at 2^n rays a side were planned
  /// [stage]: tiles of these that wait until they are as many as a plan may have.
  std::array<std::vector<RayTile>, 5> found;
  std::shared_ptr<const ViewMap> fine_map;  ///< by which finer rays are chosen; null: none yet
  uint64_t fine_changes = 0;                ///< of the model that it shows
  int looks = 0;                            ///< how many such maps there were for this camera
  std::deque<LostTiles> lost;
  uint64_t cell_rays = 0;  ///< planned so far, from beside
};

/// The view moves to another camera, or stays.
void follow(const geometry::Camera& camera, ViewerView& view);
/// What was cast is void: points were forgotten.
void forget_casts(ViewerView& view);
/// Whether a ray of the view, or one from at most around_m beside it, may meet something in these leaves.
bool may_see(const geometry::Camera& camera, double around_m, const points::ModelConfig& model,
             std::span<const points::ClusterKey> leaves);

/// Nobody says that a viewer left, so what is kept is bounded: those that asked for nothing for longest go first.
class ViewerViews {
 public:
  static constexpr size_t kMaxViewers = 64;                               ///< a wall has as many
  static constexpr size_t kMaxViewPixels = size_t{1} << 28;               ///< of all views together: half a byte each
  static constexpr size_t kMaxMaps = 8, kMaxMapPixels = size_t{1} << 25;  ///< kept with the views, together

  /// The viewer's, which is known from here on. References to others may end. The newest viewer's maps are kept,
  /// however large.
  ViewerView& use(InstanceId viewer);
  ViewerView* find(InstanceId viewer);
  size_t size() const { return views_.size(); }
  /// Of the maps of all views.
  size_t map_pixels() const;
  void clear() { views_.clear(); }
  /// These leaves' points were forgotten: casts of views that may see them are void.
  void forgotten(const points::ModelConfig& model, double around_m, std::span<const points::ClusterKey> leaves);

 private:
  std::list<ViewerView> views_;  // last used first
};

}  // namespace telesplat::packer
