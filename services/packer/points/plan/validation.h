// Checks the model against the scene: casts rays at some pixels that need none, spread evenly, and compares them with
// what the model shows. No clocks; one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"
#include "common/points/point_model.h"

namespace telesplat::packer {

/// Blue noise: sparse sets of pixels that are spread evenly, without regular patterns.
/// Source: Ulichney 1993, "The void-and-cluster method for dither array generation".
///     Cuts the pixels of a 64x64 square, which repeats over the image, into `share` sets of about equal size, each
/// spread evenly: round r picks set r % share, so that every pixel is picked once in `share` rounds.
class BlueNoise {
 public:
  static constexpr int kSide = 64, kMaxShare = 4096;

  /// share is clamped to [1, kMaxShare].
  explicit BlueNoise(int share);

  int share() const { return share_; }
  bool picks(int x, int y, uint64_t round) const { return (row(y, round) >> (x & (kSide - 1)) & 1) != 0; }
  /// Returns the picked pixels 64 n to 64 n + 63 of row y, for any n: as a word of an image::PixelMask.
  uint64_t row(int y, uint64_t round) const;

 private:
  int share_;
  std::vector<uint64_t> rows_;  // share x kSide
};

/// The dither array: each number of 0..4095 once, at y * 64 + x. Computed at the first call.
const std::array<uint16_t, size_t{BlueNoise::kSide} * BlueNoise::kSide>& blue_noise_ranks();

/// The model as seen in a view: planes of camera.width x camera.height pixels, row by row.
struct ShownView {
  const geometry::Camera& camera;
  std::span<const float> depth_m;    ///< +infinity: nothing
  std::span<const uint32_t> colour;  ///< 0x00RRGGBB albedo
  std::span<const uint16_t> normal;  ///< encode_normal16
  const image::PixelMask& firm;      ///< pixels whose content is believed: good and known empty ones
};

/// A tile, and the pixels of it that were cast.
struct CastTile {
  const geometry::Rect& rect;
  const image::PixelMask& cast;   ///< as large as rect
  const image::DepthImage& came;  ///< likewise, as sampled
  /// Null, or a mask of the view's size: pixels where rays have contradicted before, from this camera. There they are
  /// evidence, but make nothing stale: splats cannot show what is there, and a still view would cast the squares around
  /// again and again.
  const image::PixelMask* doubted = nullptr;
};

/// Allowed difference of a ray from the shown model. A sample agrees if it lies within the range of the pixels around,
/// widened by these tolerances.
struct Tolerance {
  float relative_depth = 0.01f;  ///< as a fraction of the depth
  int reach = 2;                 ///< distance of pixels around that count
  float colour = 32;             ///< largest difference of a channel, of 255
  float normal_cosine = 0.5f;    ///< least cosine between normals
};

class Validation {
 public:
  static constexpr int kMarkPixels = 16;     ///< side of the square that one contradiction makes stale
  static constexpr double kMarkSeconds = 1;  ///< a mark older than this is dropped if no plan has taken it up
  static constexpr size_t kMaxMarks = 4096;  ///< the oldest go first

  /// kNone: undecidable beside a silhouette. kNearer: also a hit where nothing is shown.
  enum class Verdict : uint8_t { kNone, kAgrees, kNearer, kFarther, kMissed, kColour, kNormal };

  struct Statistics {
    uint64_t rays = 0;                                                     ///< compared rays
    uint64_t nearer = 0, farther = 0, missed = 0, colour = 0, normal = 0;  ///< contradictions
    uint64_t empty_rays = 0, empty_hits = 0;  ///< rays at known empty pixels; not in the figures above
  };

  explicit Validation(const points::ModelConfig& model, const Tolerance& tolerance = {});

  /// Compares a tile's rays at firm pixels with what was shown when its frame was planned; shown.camera's image holds
  /// the tile.
  ///   contradicted: becomes a mask of the tile's size: the rays that saw something else than what is shown; their hits
  ///   are new points.
  void check(const ShownView& shown, const CastTile& tile, double now_s, image::PixelMask& contradicted);

  /// Sets in `mask`, which is as large as the camera's image, a square of kMarkPixels pixels around each mark in sight.
  void mark_stale(const geometry::Camera& camera, double now_s, image::PixelMask& mask);
  /// The frame of the plan that called mark_stale at planned_s is complete: drops that plan's marks.
  void resampled(double planned_s);

  /// Returns the clusters that rays have disproved since the last call, ascending.
  std::vector<points::ClusterKey> disproved();
  /// Clusters were forgotten: evidence about their old points is void.
  void forgotten(std::span<const points::ClusterKey> clusters);

  void clear();  ///< begins a new epoch
  const Statistics& statistics() const { return statistics_; }
  size_t marks() const { return marks_.size(); }

  /// Judges one ray. shown_x, shown_y: its pixel in the view.
  Verdict judge(const ShownView& shown, int shown_x, int shown_y, const image::DepthImage& came, size_t pixel) const;

 private:
  struct Mark {
    glm::dvec3 position_room;
    double made_s = 0, planned_s = -1;  // planned_s: when a plan last had it in sight
  };
  // Rays at a cluster since it last changed; older ones count less and less.
  struct Evidence {
    float agree = 0, contradict = 0;
    double s = 0, strike_s = 0;
    uint8_t strikes = 0;  // times the cluster was disproved: each doubles the proof that is needed
  };
  bool take(const ShownView& shown, const CastTile& tile, int x, int y, double now_s);
  void count(Verdict verdict, bool empty);
  void note(points::ClusterKey key, bool agrees, double now_s);
  void mark(const glm::dvec3& position_room, double now_s);

  points::OctreeGrid grid_;
  Tolerance tolerance_;
  std::vector<Mark> marks_;
  image::PixelMask marked_;  // squares of the current tile that have a mark
  std::unordered_map<points::ClusterKey, Evidence> evidence_;
  std::vector<points::ClusterKey> disproved_;
  Statistics statistics_;
};

}  // namespace telesplat::packer
