// What the planner remembers: rays as tiles with masks, frames whose tiles are under way and what their rays have told
// so far, and each viewer's last view with what was cast for it already.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <span>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/image/pixel_mask.h"
#include "common/wire/tile_messages.h"
#include "services/packer/points/event.h"
#include "services/packer/points/plan/view/view_map.h"

namespace telesplat::packer {

/// Rays to be cast in a rectangle of a view.
struct RayTile {
  geometry::Rect rect;
  image::PixelMask mask;  ///< of rect's size
  uint64_t rays = 0;      ///< at least one
};

struct TileLimits {
  int size = 256;     ///< pixels: longest side; at least kLeastTile
  uint64_t rays = 0;  ///< a tile that is longer than kLeastTile has no more; 0: no limit
};
inline constexpr int kLeastTile = 32;

/// The part of a mask in a rectangle. Precondition: it lies in the mask.
image::PixelMask cropped(const image::PixelMask& mask, const geometry::Rect& rect);
/// Sets in `mask` what `part`, which lies at (x, y), has set.
void merge(const image::PixelMask& part, int x, int y, image::PixelMask& mask);

/// Cuts the part of a mask in `area`, which lies in it, into tiles: the box of its rays, halved across its longer side
/// while it is too long or has too many rays, so that about as many rays lie on either side; and each half likewise.
/// None has no rays.
std::vector<RayTile> cut_tiles(const image::PixelMask& mask, const geometry::Rect& area, const TileLimits& limits);

/// Takes from `cast` those of its rays in `some`, a part of it, that are farthest from the middle, by pieces of 64 x
/// 16 pixels, so that about `most` of them stay. Returns how many it took.
uint64_t put_off_rays(const image::PixelMask& some, uint64_t most, image::PixelMask& cast);

/// Those whose middle is nearest the middle of width x height pixels come first.
void sort_by_distance_to_centre(std::vector<RayTile>& tiles, int width, int height);

/// Adds the tiles to a plan, as many as messages allow. Returns how many.
size_t add_tiles(const std::vector<RayTile>& tiles, int threads, wire::Plan& plan);

struct PlannedFrame {
  enum class Kind {
    kView,  ///< what a viewer asked for
    kCell,  ///< from beside it
    kFine   ///< finer than it
  };
  FrameId id;
  InstanceId viewer;
  Kind kind = Kind::kView;
  geometry::Camera camera;
  geometry::Camera base;  ///< of rays beyond a view: the view's
  double planned_s = 0;

  /// Rays that are to be cast; none of a frame whose tiles are cast whole.
  std::vector<RayTile> tiles;
  std::vector<bool> returned;  ///< one a tile
  bool whole = false;
  bool ended = false;   ///< some of its tiles do not come
  uint64_t left = 0;    ///< tiles, or of a whole frame pixels, that have not come
  uint64_t passed = 0;  ///< rays that came, and met nothing
  size_t held = 0;      ///< FrameShelf::held()

  std::shared_ptr<ViewMap> map;  ///< what was shown when it was planned; null: not known
  image::PixelMask firm;         ///< of the camera's size, if there is a map: Validation, ShownView::firm
  image::PixelMask put_off;      ///< pixels that wait for a later view: the space before them is known; may be empty
  /// map->nearest_m has the samples that came since, too, but those of this frame, which are of other pixels.
  bool nearest_known = true;
  /// Of each tile: depths in the order of its mask's pixels, +infinity where a ray met nothing. Of finer frames none.
  std::vector<std::vector<float>> came_m;
  std::vector<float> whole_m;  ///< of whole frames: the same of all pixels, 0: did not come

  bool complete() const { return left == 0; }
  size_t find(const geometry::Rect& rect) const;  ///< tiles.size(): there is none
};

/// Those of the newest frames that fit the limits. References are valid until the next call of add() or drop().
class FrameShelf {
 public:
  static constexpr size_t kMaxFrames = 64;
  /// Of all frames together: held(). A larger view is not planned.
  static constexpr size_t kMaxPixels = size_t{1} << 25;

  PlannedFrame* find(FrameId id);
  /// Drops the oldest ones to make room, and one with the same number.
  PlannedFrame& add(PlannedFrame frame);
  void drop(FrameId id);
  void clear() { frames_.clear(); }
  std::deque<PlannedFrame>& frames() { return frames_; }
  const std::deque<PlannedFrame>& frames() const { return frames_; }
  /// What a frame takes, as pixels of whole frames and of maps, which are the most of it.
  static size_t held(const PlannedFrame& frame);
  /// Tiles of it have not come for so long that nobody waits for them: most links and samplers are sooner.
  static bool given_up(const PlannedFrame& frame, double now_s) {
    constexpr double kPatience_s = 10;
    return !frame.complete() && now_s - frame.planned_s > kPatience_s;
  }

 private:
  std::deque<PlannedFrame> frames_;  // oldest first
};

/// KnownEmpty::carve(): up to where each ray of the frame is known to have met nothing; negative where this was known
/// before.
void clear_depths(const PlannedFrame& frame, std::vector<float>& clear_m);

/// Some view is not complete that was planned, or whose first tile came, less than a quarter of a second ago. One that
/// takes longer may have been given up.
bool view_under_way(const FrameShelf& shelf, double now_s);

/// Some frame is complete whose rays have passed so much that to cast them again would cost more than to learn from it.
bool tells_much(const FrameShelf& shelf);

/// A patch goes into the model. Of the newest frames under way the nearest samples stay known, of others not.
void note_inserted(const points::PreparedPatch& patch, const points::ModelConfig& model, FrameShelf& shelf);

/// The depths of a tile's pixels in metres, +infinity where nothing is. cast: of the tile's size.
std::vector<float> depths_of(const SampledTile& tile, const image::PixelMask& cast);
/// All of them, into an image of the camera's size.
void write_depths(const SampledTile& tile, std::vector<float>& depth_m);

/// Tiles that were planned and have not come: of frames that the master gave up for a new view.
struct LostTiles {
  geometry::Camera camera;
  PlannedFrame::Kind kind = PlannedFrame::Kind::kFine;
  std::vector<RayTile> tiles;
};

/// What the planner remembers of each viewer: its last view, and what was cast for it already.
struct ViewerView {
  InstanceId viewer;
  geometry::Camera camera;
  bool known = false;            ///< there was a view
  bool still = false;            ///< the view before was seen by the same camera
  glm::dvec3 movement_m{0};      ///< of the eye since the view before
  std::shared_ptr<ViewMap> map;  ///< of `camera`; null: none
  uint64_t map_changes = 0;      ///< of the model that it shows: Planner::changes_
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
