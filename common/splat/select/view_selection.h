// Chooses the points of a model for a view, their level and splat size (T4.4.3).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/clip.h"
#include "common/points/summary.h"
#include "common/splat/base_mesh.h"

namespace telesplat::splat {

struct SelectionOptions {
  float scale = 1.0f;          ///< the "scale factor" of T eq. 4.8
  float hide_ratio = 1.5f;     ///< "ratio" of T4.4.3: a splat larger than this times the best one's size is revised ...
  float hide_epsilon = 0.25f;  ///< ... to best + epsilon * its size
  float max_splat_px = 16.0f;  ///< largest size of a splat
  /// In (0, 1]: points drawn on each axis for a sample or a display pixel, the larger of the two (T4.4.3.1).
  float detail = 1.0f;
  bool transitions = true;  ///< true: blends neighbouring levels; false: draws the closest level whole
  bool cone_culling = true;
  bool rests = false;  ///< true: also chooses points of heads at rest, which are finer than pixels
  /// For models that kept redundant patches: draws the best ones of each cluster (patch_choice.h).
  bool best_patch_only = false;
  /// The list serves two eyes: it has the points that either eye sees, with splats of the size that the camera asks
  /// for, which stands between them. The eyes have its orientation and its pixel size. Nothing: for the camera alone.
  std::optional<std::array<geometry::Camera, 2>> eyes = {};
};

/// Consecutive points of one mosaic level to draw. Pointers are valid until the model changes (or the viewer's frame
/// ends).
struct DrawItem {
  const points::Cluster* cluster;
  points::Mosaic::Level level;  ///< the points drawn
  float splat_px;               ///< side (square) or diameter (disc) in display pixels, >= 1
  /// The mosaic's sequence. With cluster->key it names the points, for renderers that keep copies. 0: keep none.
  Sequence sequence{};
  /// Surfel kernels: radius of a splat that faces its sampling view, metres in room space. It is half of splat_px at
  /// the leaf's centre, but not widened to a pixel.
  float radius_m = 0;
  /// Surfel kernels: from the leaf towards the eye of the sampling view, unit length; or zero.
  glm::vec3 to_eye{0, 0, 1};
  uint32_t first = 0;          ///< index of level[0] in arrays()
  uint32_t of = 0;             ///< number of points in arrays(); 0: as many as are drawn
  bool may_face_away = false;  ///< some of its points may face away; those are not drawn (facing.h)

  /// The whole level: the drawn points are its points [first, first + level.count). The level stays the same from frame
  /// to frame while that part changes, so renderers can keep copies of it.
  points::Mosaic::Level arrays() const {
    return {of ? of : level.count, level.x - first,      level.y - first,
            level.z - first,       level.normal - first, level.colour - first};
  }
};

struct DrawList {
  std::vector<DrawItem> items;
  /// Clusters that passed culling: for access reports. With SelectionOptions::best_patch_only a cluster is listed once
  /// for each of its patches that is drawn, and frames_seen has the frame tags of those patches, one an entry. Without
  /// it frames_seen is empty.
  std::vector<points::ClusterKey> clusters_seen;
  std::vector<uint32_t> frames_seen;
  /// Bricks that would be drawn as a summary, or as a newer one, if it existed.
  std::vector<points::ClusterKey> summaries_wanted;
  uint64_t points = 0;
  /// SelectionOptions::scale: splat_px / scale is the distance of an item's samples on the screen.
  float scale = 1.0f;
  double distance_m = 0;  ///< mean distance of the points drawn, by their leaves; 0 without points
  Sequence applied;       ///< newest event of the model that the points were selected from
  EpochId epoch;          ///< epoch of that model; a list never has points of two epochs
  /// With it, a DrawItem's cluster and sequence identify the points: another packer numbers its events from 1 again.
  uint64_t replica = 0;
  std::vector<std::shared_ptr<const void>>
      held;  ///< memory of items whose points belong to no model; the code that adds it clears it
  /// Shows where the points leave pixels empty (backdrop.h), or null.
  std::shared_ptr<const BaseMesh> base;
  geometry::Clip base_clip;  ///< cuts the base; points are cut already
  uint64_t summaries = 0;        ///< number of summaries made by then, of all replicas
};

/// True if a backdrop is to be drawn.
inline bool has_base(const DrawList& list) { return list.base && !list.base->nodes.empty(); }

/// Culls clusters by frustum, mosaics by normal cone; chooses the number of each mosaic's points (level_choice.h): the
/// desired pixel range is the display's, or the sampling view's if that is less, times detail. Splat size = scale *
/// display's pixel range / pixel range of the points drawn (T eq. 4.8), revised as in T4.4.3. A mosaic between two
/// levels becomes two items, next to each other.
///   summaries: of the model's bricks, or null. A brick that spans at most as many pixels as its summary has samples is
///   drawn as the summary and the newer mosaics. So distant bricks cost as much as the pixels they cover. Not with
///   options.best_patch_only.
void select_view(const points::PointModel& model, const geometry::Camera& camera, const SelectionOptions& options,
                 DrawList& out, const points::Summaries* summaries = nullptr);

/// Hashes the points of a list and their splat sizes. Two lists of one replica with the same hash show the same.
uint64_t names_of(const DrawList& list);

/// True if every point of the mosaic faces away from the camera. The packer's reference depth map and the viewers use
/// this one test, so that a mosaic that viewers cull does not count as seen.
bool faces_away(const points::Mosaic& mosaic, const geometry::Box& leaf_room, const glm::vec3& eye_room);

}  // namespace telesplat::splat
