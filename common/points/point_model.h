// The point model (T4.3): a level-limited octree of clusters, each a list of mosaics. The packer owns the authoritative
// one; every viewer replicates it by applying the same events in the same order. No sockets, no clocks, no threads
// inside.
//
// Determinism: the same events give the same bytes on every machine and instruction set (IEEE arithmetic without
// contraction).
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/normal.h"

namespace telesplat::points {

inline constexpr int kLevels = 3;           ///< level 0: every sample, 1: one of 2x2 pixels, 2: one of 4x4
inline constexpr int kMaxOctreeDepth = 10;  ///< 1024 leaves a side at most

/// The 24 bits of a frame tag, which tagged() makes.
inline constexpr uint32_t kFrameTagMask = (1u << 24) - 1;
/// The bit of a frame tag that coarse passes have, and what was sampled from coarser data than it should.
inline constexpr uint32_t kProvisionalTag = 1u << 23;
/// The bit of a frame tag that points of a head at rest have; the other bits are the number of that rest.
inline constexpr uint32_t kRestTag = 1u << 22;
/// Tag of a frame, for prepare_patch(): its number, or that of a head's rest (if not 0), with the bits of provisional
/// points and of a rest.
constexpr FrameId tagged(FrameId frame, bool provisional, uint64_t rest = 0) {
  if (rest != 0) return {(rest & (kRestTag - 1)) | kRestTag};
  return {(frame.value & (kRestTag - 1)) | (provisional ? kProvisionalTag : 0)};
}
/// Returns the tag if its points are provisional, else 0.
constexpr uint32_t group_of(uint32_t tag) { return (tag & (kProvisionalTag | kRestTag)) != 0 ? tag : 0; }

/// The place of a cluster's leaf: its integer coordinates, `depth` bits each, in the octree's cube; x in the low bits
/// (x | y << 10 | z << 20).
using ClusterKey = uint32_t;

struct ModelConfig {
  geometry::Box
      box_room;   ///< the data set's box; the octree's cube is its smallest enclosing cube about the same centre, grown
                  ///< by 1/1000, so that points on the boundary lie inside
  int depth = 5;  ///< octree depth: 2^depth leaves a side
  bool compact = false;  ///< mosaics of a cluster are merged (compaction.h); false: each stays as it came
  bool operator==(const ModelConfig&) const = default;
};

/// Refuses boxes that are empty, not finite or beyond 1e6 m, and depths outside [0, kMaxOctreeDepth]. For
/// configurations that arrive from outside; every other function here requires a configuration that passed.
Status validate(const ModelConfig& config);

/// Points of one cluster, of about equal density: the part of one patch (of one tile) inside it, or several such parts
/// after a merge (compaction.h). One allocation with three levels of detail.
/// Positions are fractions of the leaf: position_room = leaf.lo + (q + 0.5) / 65536 * leaf_size. Colours are 0x00RRGGBB
/// (top byte = flags, 0). A coarse level's points are the first ones of the finer level, so that it shares their
/// positions and normals and adds only its mean colours. With n0 >= n1 >= n2 points the allocation holds
///   uint16 x[n0], y[n0], z[n0], normal[n0]; uint32 colour0[n0]; colour1[n1] if n1 < n0; colour2[n2] if n2 < n1
/// (if two levels have equally many points, these are the same points): 12 to 14 bytes a point.
class Mosaic {
 public:
  /// Arrays of `count` elements; colour starts at a multiple of 4 bytes, the others of 2.
  struct Level {
    uint32_t count = 0;
    const uint16_t *x = nullptr, *y = nullptr, *z = nullptr, *normal = nullptr;
    const uint32_t* colour = nullptr;
  };
  Level level(int l) const {
    const uint32_t n = counts_[0];
    const auto* positions = reinterpret_cast<const uint16_t*>(data_.get());
    const auto* colour = reinterpret_cast<const uint32_t*>(positions + size_t{4} * n);
    if (l >= 1 && counts_[1] < counts_[0]) colour += counts_[0];
    if (l >= 2 && counts_[2] < counts_[1]) colour += counts_[1];
    return {counts_[l], positions, positions + n, positions + size_t{2} * n, positions + size_t{3} * n, colour};
  }
  uint32_t count(int l) const { return counts_[l]; }

  /// Sequence of the event that brought it, or of the newest one merged into it, modulo 2^40.
  Sequence sequence() const { return {sequence_and_frame_ & ((uint64_t{1} << kSequenceBits) - 1)}; }
  /// The sampling frame's number modulo 2^24: equal for all tiles of one frame, that is, for the mosaics of one patch
  /// (T4.3.2).
  uint32_t frame_tag() const { return static_cast<uint32_t>(sequence_and_frame_ >> kSequenceBits); }
  /// Its points are removed by their tag, and redundancy elimination ignores them: those of a coarse pass when the
  /// complete frame is there, those of a head at rest when it has moved on.
  bool provisional() const { return group() != 0; }
  /// The tag, if provisional; else 0. Mosaics of one group are merged, except those of a coarse pass.
  uint32_t group() const { return group_of(frame_tag()); }
  bool of_rest() const { return (frame_tag() & kRestTag) != 0; }
  /// Projected pixels across the cluster's cube in the sampling view: leaf size * focal / depth of the leaf's centre
  /// (the linear "pixel range" in T4.3.2). Level l has pixel_range() / 2^l. A merged mosaic has the mean.
  float pixel_range() const { return pixel_range_; }
  /// Normal cone [Shirman 93]: every normal n of the mosaic has dot(n, axis) >= cosine. cosine = -1: no cone.
  glm::vec3 cone_axis() const { return image::decode_normal16(cone_axis_); }
  float cone_cosine() const { return static_cast<float>(cone_cosine_) / 127.0f; }
  /// cone_axis() before it is normalised.
  glm::vec3 cone_axis_direction() const { return image::octahedral16(cone_axis_); }
  /// Unit vector from the leaf's centre towards the eye of the sampling view: with pixel_range() it gives the
  /// distance of the samples on the surface (T4.4.1). Zero if points from views in different directions were merged:
  /// then the distance is the same along all directions.
  glm::vec3 direction_to_eye() const {
    return direction_to_eye_ == kNoDirection ? glm::vec3(0) : glm::normalize(image::octahedral16(direction_to_eye_));
  }
  /// Mean position of the level-0 points, room space, to 1/256 of the leaf.
  glm::vec3 centroid_room(const geometry::Box& leaf) const;
  /// Memory of this mosaic: header, points and the allocator's overhead.
  size_t bytes() const;
  /// Hash of all its content.
  uint64_t digest() const;

 private:
  friend class MosaicBuilder;
  static constexpr int kSequenceBits = 40;
  static constexpr uint16_t kNoDirection = 0xffff;  // which encode_normal16 never gives
  size_t data_bytes() const;
  std::unique_ptr<std::byte[]> data_;
  uint64_t sequence_and_frame_ = 0;  // the frame in the top 24 bits
  std::array<uint32_t, kLevels> counts_{};
  float pixel_range_ = 0;
  uint16_t cone_axis_ = 0;
  int8_t cone_cosine_ = -127;
  std::array<uint8_t, 3> centroid_{};
  uint16_t direction_to_eye_ = 0;
};

/// A point in the form that mosaics hold.
struct LeafPoint {
  uint16_t x, y, z;  ///< fractions of the leaf, as in Mosaic
  uint16_t normal;
  uint32_t colour;
  bool operator==(const LeafPoint&) const = default;
};

struct Cluster {
  ClusterKey key = 0;
  geometry::Box leaf_room;      ///< the leaf's cube
  std::vector<Mosaic> mosaics;  ///< in order of sequence
};

/// A cube of 4 x 4 x 4 leaves, two levels above them (fewer if the octree is less deep), and the clusters in it: a walk
/// over the model tests cubes first.
struct Brick {
  geometry::Box box_room;
  std::vector<const Cluster*> clusters;  ///< in no particular order; at least one
  uint64_t changes = 0;                  ///< counts insertions and removals
  /// differs after every removal of points from it, even if the brick itself was removed in between
  uint64_t removals = 0;
};

/// The points of one patch part, sorted into leaves and levels, ready to be inserted. Making it needs no model, so a
/// viewer's worker makes it while its display thread reads the model.
struct PreparedPatch {
  Sequence sequence;
  std::vector<std::pair<ClusterKey, Mosaic>> mosaics;  ///< ascending keys
  uint64_t points = 0;                                 ///< level-0 points
  uint64_t outside = 0;  ///< samples outside the octree's cube: dropped (0 if the data set's box is correct)
};

/// Unprojects the covered pixels of a depth-image tile, sorts them into leaves, decimates (T4.3.2, T7.2) and computes
/// each mosaic's attributes.
///   frame: tag (tagged()) of the tile's sampling frame, which its mosaics share.
///   camera: the frame's camera; tile: where `image` lies in it (image is tile.width x tile.height).
///   Level l+1 makes one point of covered pixels in each block of 2x2 pixels of level l (blocks are aligned to the
///   frame's pixel grid): of those that fall in the same leaf and lie within 2 % of the first one's depth. The point is
///   the sample nearest the block's centre (the first in Z order of several), with the mean colour of them all. The
///   other pixels make further points in the same way.
///   So coarse levels keep the coverage of a surface and of surfaces behind its edge.
/// Runs in the calling thread; several threads may prepare several tiles at once.
/// Preconditions: valid(config), valid(camera), tile inside the camera's image, image canonical and of the tile's size.
PreparedPatch prepare_patch(const ModelConfig& config, Sequence sequence, const geometry::Camera& camera,
                            const geometry::Rect& tile, const image::DepthImage& image, FrameId frame = {});

/// Projected pixels across a leaf's cube: leaf_size * focal_x / depth of its centre (at least half a leaf).
float pixel_range(const geometry::Camera& camera, const glm::dvec3& leaf_centre_room, double leaf_size_m);

/// Changes to each cluster when a patch, or a refinement (refinement.h), is inserted.
struct Insertion {
  struct Change {
    ClusterKey key;
    std::vector<uint32_t> replaced;  ///< indices among the cluster's mosaics, ascending
    std::vector<Mosaic> added;       ///< appended after the mosaics that stay
    /// New mosaics for these indices, ascending, with as many points; `replaced` and `added` are empty then.
    std::vector<std::pair<uint32_t, Mosaic>> renewed = {};
  };
  Sequence sequence;
  std::vector<Change> changes;  ///< ascending keys
};

class PointModel {
 public:
  explicit PointModel(const ModelConfig& config);

  const ModelConfig& config() const { return config_; }
  /// Event "patch". Sequences must rise. Copies points if mosaics are merged; else takes every mosaic over.
  void insert(PreparedPatch patch) { commit(plan(std::move(patch))); }
  /// The same in two steps. The first only reads the model, so others may read it at the same time. No event may come
  /// between them.
  Insertion plan(PreparedPatch patch) const;
  /// O(mosaics). Returns the replaced mosaics: a viewer keeps them alive until its frame is drawn.
  std::vector<Mosaic> commit(Insertion insertion);
  /// Event "forget": drops whole clusters. Ignores unknown keys. Returns the dropped clusters.
  std::vector<Cluster> forget(std::span<const ClusterKey> keys);
  /// The same, but the clusters stay in place in memory: a viewer keeps them alive until its frame is drawn, since draw
  /// lists point to clusters and not only to their points.
  std::vector<std::unique_ptr<Cluster>> take_out(std::span<const ClusterKey> keys);
  /// Event "forget" of single patches: drops the mosaics with frame tag frames[i] from cluster keys[i], and the cluster
  /// if it becomes empty. Ignores unknown ones. Returns clusters with the dropped mosaics alone, one for each i that
  /// found some. Precondition: as many frames as keys.
  std::vector<Cluster> forget(std::span<const ClusterKey> keys, std::span<const uint32_t> frames);
  /// The same for a viewer: draw lists made before stay drawable while it keeps the result. A cluster that becomes
  /// empty is returned in place; one that stays has other mosaics, whose points do not move.
  std::vector<std::unique_ptr<Cluster>> take_out(std::span<const ClusterKey> keys, std::span<const uint32_t> frames);
  /// Event "new epoch": drops everything.
  void clear();

  /// All clusters, in no particular order. Pointers are stable until that cluster is forgotten; a cluster's mosaic
  /// vector grows on insert.
  const std::unordered_map<ClusterKey, std::unique_ptr<Cluster>>& clusters() const { return clusters_; }
  const Cluster* find(ClusterKey key) const;
  /// The same clusters by bricks. Pointers are stable until the brick's last cluster is forgotten.
  const std::unordered_map<ClusterKey, std::unique_ptr<Brick>>& bricks() const { return bricks_; }

  uint64_t points() const { return points_; }  ///< level-0 points held
  uint64_t bytes() const;                      ///< memory of the whole model: points, headers, containers
  uint64_t points_in(ClusterKey key) const;
  /// Order-independent digest of every cluster's key and every mosaic's bytes: equal models have equal digests.
  uint64_t digest() const;

 private:
  Brick& brick_of(ClusterKey key);  // counts a change

  ModelConfig config_;
  std::unordered_map<ClusterKey, std::unique_ptr<Cluster>> clusters_;
  std::unordered_map<ClusterKey, std::unique_ptr<Brick>> bricks_;  // by brick_key
  uint64_t points_ = 0;
  uint64_t removals_ = 0;       // removals of clusters or mosaics so far
  uint64_t cluster_bytes_ = 0;  // memory of all clusters and their content
};

/// A leaf's brick: its coordinates without their last two bits.
constexpr ClusterKey brick_key(ClusterKey leaf) { return leaf & ~(3u | 3u << 10 | 3u << 20); }

/// The octree's cube and a leaf's cube.
geometry::Box octree_cube(const ModelConfig& config);
geometry::Box leaf_box(const ModelConfig& config, ClusterKey key);

/// The same cube, unrounded, for sorting points into leaves: leaf = floor((p - lo) / leaf_size) on each axis.
struct OctreeGrid {
  glm::dvec3 lo{0};
  double leaf_size = 0;
  int depth = 0;
};
OctreeGrid octree_grid(const ModelConfig& config);

}  // namespace telesplat::points
