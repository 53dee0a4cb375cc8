// Frames whose tiles are under way, and what their rays have told so far.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "common/core/ids.h"
#include "services/packer/points/plan/ray_tiles.h"
#include "services/packer/points/plan/view/view_map.h"
#include "services/packer/points/sampled_tile.h"

namespace telesplat::packer {

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

}  // namespace telesplat::packer
