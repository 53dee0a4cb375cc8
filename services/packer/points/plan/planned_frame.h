// The planner's memory: rays as tiles with masks, frames whose tiles are under way with the results of their rays so
// far, and each viewer's last view with the rays that were cast for it already.
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
  image::PixelMask mask;  ///< as large as rect
  uint64_t rays = 0;      ///< at least one
};

struct TileLimits {
  int size = 256;     ///< pixels: longest side; at least kLeastTile
  uint64_t rays = 0;  ///< rays in a tile, at most; tiles up to kLeastTile long may have more; 0: no limit
};
inline constexpr int kLeastTile = 32;

/// Returns the part of a mask in a rectangle. Precondition: it lies in the mask.
image::PixelMask cropped(const image::PixelMask& mask, const geometry::Rect& rect);
/// Sets those pixels of `mask` that are set in `part`, which lies at (x, y).
void merge(const image::PixelMask& part, int x, int y, image::PixelMask& mask);

/// Cuts the part of a mask in `area`, which lies in it, into tiles: the box of its rays, halved across its longer side
/// while it is too long or has too many rays, so that about as many rays lie on either side; and each half likewise.
/// Tiles without rays are left out.
std::vector<RayTile> cut_tiles(const image::PixelMask& mask, const geometry::Rect& area, const TileLimits& limits);

/// Removes from `cast` those rays of `some`, a part of it, that are farthest from the middle, in pieces of 64 x 16
/// pixels, so that about `most` of them stay. Returns the number of removed rays.
uint64_t put_off_rays(const image::PixelMask& some, uint64_t most, image::PixelMask& cast);

/// Sorts tiles by the distance of their middle from the middle of width x height pixels, nearest first.
void sort_by_distance_to_centre(std::vector<RayTile>& tiles, int width, int height);

/// Adds tiles to a plan, up to the limit of a message. Returns the number of added tiles.
size_t add_tiles(const std::vector<RayTile>& tiles, int threads, wire::Plan& plan);

struct PlannedFrame {
  enum class Kind {
    kView,  ///< a viewer asked for it
    kCell,  ///< from beside a view
    kFine   ///< finer than a view
  };
  FrameId id;
  InstanceId viewer;
  Kind kind = Kind::kView;
  geometry::Camera camera;
  geometry::Camera base;  ///< kCell, kFine: the view's camera
  double planned_s = 0;

  /// Rays to be cast; empty for a frame whose tiles are cast whole.
  std::vector<RayTile> tiles;
  std::vector<bool> returned;  ///< one per tile
  bool whole = false;
  bool ended = false;   ///< its remaining tiles do not come
  uint64_t left = 0;    ///< tiles that have not come; if whole, pixels
  uint64_t passed = 0;  ///< rays that have come and met nothing
  size_t held = 0;      ///< size by FrameShelf::held()

  std::shared_ptr<ViewMap> map;  ///< the model as seen when the frame was planned; null: not known
  image::PixelMask firm;         ///< as large as the map, if there is one: Validation, ShownView::firm
  image::PixelMask put_off;      ///< pixels put off to a later view: the space before them is known; may be empty
  /// map->nearest_m also has samples that came since, except the frame's own, which lie in other pixels.
  bool nearest_known = true;
  /// For each tile: depths in the order of its mask's pixels, +infinity where a ray met nothing. Empty for kFine.
  std::vector<std::vector<float>> came_m;
  std::vector<float> whole_m;  ///< pixels in order, if whole; 0: not come

  bool complete() const { return left == 0; }
  size_t find(const geometry::Rect& rect) const;  ///< tiles.size(): no such tile
};

/// Holds the newest frames that fit the limits. References stay valid until the next call of add() or drop().
class FrameShelf {
 public:
  static constexpr size_t kMaxFrames = 64;
  /// Limit for held() of all frames together. A larger view is not planned.
  static constexpr size_t kMaxPixels = size_t{1} << 25;

  PlannedFrame* find(FrameId id);
  /// Drops the oldest frames to make room, and a frame with the same number.
  PlannedFrame& add(PlannedFrame frame);
  void drop(FrameId id);
  void clear() { frames_.clear(); }
  std::deque<PlannedFrame>& frames() { return frames_; }
  const std::deque<PlannedFrame>& frames() const { return frames_; }
  /// Estimates a frame's memory, in pixels of whole frames and of maps, which take most of it.
  static size_t held(const PlannedFrame& frame);
  /// True if its tiles have been missing for kPatience_s: no viewer waits for them; most links and samplers are faster.
  static bool given_up(const PlannedFrame& frame, double now_s) {
    constexpr double kPatience_s = 10;
    return !frame.complete() && now_s - frame.planned_s > kPatience_s;
  }

 private:
  std::deque<PlannedFrame> frames_;  // oldest first
};

/// Returns in clear_m, for KnownEmpty::carve(), the depth up to which each ray of the frame is known to have met
/// nothing; negative where this was known before.
void clear_depths(const PlannedFrame& frame, std::vector<float>& clear_m);

/// True if an incomplete view was planned, or its first tile came, less than a quarter of a second ago. A view that
/// takes longer may have been given up.
bool view_under_way(const FrameShelf& shelf, double now_s);

/// True if a complete frame's rays passed enough space that casting them again would cost more than settling it.
bool tells_much(const FrameShelf& shelf);

/// A patch goes into the model: updates the nearest samples of the newest frames under way; older frames lose theirs.
void note_inserted(const points::PreparedPatch& patch, const points::ModelConfig& model, FrameShelf& shelf);

/// Returns the depths of a tile's pixels in metres, +infinity where a ray met nothing. cast: as large as the tile.
std::vector<float> depths_of(const SampledTile& tile, const image::PixelMask& cast);
/// Writes the depths of all its pixels into an image of the camera's size.
void write_depths(const SampledTile& tile, std::vector<float>& depth_m);

/// Planned tiles that have not come, from frames that the master gave up for a new view.
struct LostTiles {
  geometry::Camera camera;
  PlannedFrame::Kind kind = PlannedFrame::Kind::kFine;
  std::vector<RayTile> tiles;
};

/// The turn of a view's good pixels: each is cast now and then to be checked.
struct ValidationTurn {
  uint64_t round = 0;  ///< sets of pixels that had their turn
  double sets_due = 0, at_s = -1e9;

  /// Returns the number of pixel sets that are due, at most `most`. `sets` of them become due in turn_s, evenly.
  uint64_t take_due(int sets, double turn_s, double most, double now_s);
};

/// The planner's memory of a viewer: its last view, and the rays that were cast for it already.
struct ViewerView {
  InstanceId viewer;
  geometry::Camera camera;
  bool known = false;            ///< there was a view
  bool still = false;            ///< the view before was seen by the same camera
  glm::dvec3 movement_m{0};      ///< movement of the eye since the view before
  std::shared_ptr<ViewMap> map;  ///< the model as seen by `camera`; null: not rendered
  uint64_t map_changes = 0;      ///< Planner::changes_ when `map` was rendered
  image::PixelMask done;         ///< pixels that were cast for this camera
  image::PixelMask doubted;      ///< pixels whose rays contradicted the model, from this camera
  ValidationTurn validation;

  // Extra rays for this camera.
  unsigned cell_turn = 0;                   ///< the next direction; goes on from view to view
  unsigned cells_done = 0;                  ///< bit i: no ray from direction i is left to be cast
  std::array<image::PixelMask, 3> refined;  ///< [n]: pixels of the view whose 2^n x 2^n rays were planned
  /// [stage]: tiles of finer rays that wait until they fill a plan.
  std::array<std::vector<RayTile>, 5> found;
  std::shared_ptr<const ViewMap> fine_map;  ///< the map by which finer rays are chosen; null: not rendered
  uint64_t fine_changes = 0;                ///< Planner::changes_ when `fine_map` was rendered
  int looks = 0;                            ///< number of such maps for this camera so far
  std::deque<LostTiles> lost;
  uint64_t cell_rays = 0;  ///< rays from beside that were planned so far
};

/// The view moves to another camera, or stays.
void follow(const geometry::Camera& camera, ViewerView& view);
/// Points were forgotten: the rays that were cast count no more.
void forget_casts(ViewerView& view);
/// True if a ray of the view, or one from at most around_m beside it, may meet a surface in these leaves.
bool may_see(const geometry::Camera& camera, double around_m, const points::ModelConfig& model,
             std::span<const points::ClusterKey> leaves);

/// Keeps each viewer's view. Viewers leave without notice, so memory is bounded: those silent for longest go first.
class ViewerViews {
 public:
  static constexpr size_t kMaxViewers = 64;                               ///< as many as a wall of displays has
  static constexpr size_t kMaxViewPixels = size_t{1} << 28;               ///< all views together; half a byte each
  static constexpr size_t kMaxMaps = 8, kMaxMapPixels = size_t{1} << 25;  ///< for all views together

  /// Returns the viewer's view, new or known. References to others may end. The newest viewer's maps are kept even
  /// beyond the limits.
  ViewerView& use(InstanceId viewer);
  ViewerView* find(InstanceId viewer);
  size_t size() const { return views_.size(); }
  /// Returns the number of pixels in the maps of all views.
  size_t map_pixels() const;
  void clear() { views_.clear(); }
  /// The points of these leaves were forgotten: casts of views that may see them are void.
  void forgotten(const points::ModelConfig& model, double around_m, std::span<const points::ClusterKey> leaves);

 private:
  std::list<ViewerView> views_;  // last used first
};

}  // namespace telesplat::packer
