// Maps of the model as seen in a view, pixel by pixel, and of the samples that it lacks there.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/pixel_mask.h"
#include "common/points/point_model.h"
#include "common/splat/reference/tangent_planes.h"
#include "common/splat/reference/view_keys.h"
#include "services/packer/points/plan/view/judge_rows.h"

namespace telesplat::packer {

/// Tiles of this size are processed at once: their keys and points fit into the second-level cache.
inline constexpr int kPlanTileWidth = 256, kPlanTileHeight = 128;

/// Conditions for a pixel to count as shown.
struct PixelTest {
  float relative_epsilon = 0.004f;  ///< points this close to the surface, as a fraction of depth, belong to it
  /// A covered pixel lacks a sample if no point of its surface lies in it or within this many pixels of its centre (up
  /// to 1.5).
  float nearest = 0.6f;
};

/// Planes and masks of camera.width x camera.height pixels, row by row.
struct ViewMap {
  geometry::Camera camera;
  std::vector<float> depth_m;    ///< +infinity: nothing
  std::vector<uint32_t> colour;  ///< 0x00RRGGBB albedo; 0: nothing
  std::vector<uint16_t> normal;  ///< encode_normal16; 0: nothing
  /// As render_reference_depth(): the nearest sample in each pixel, with its place in the pixel in the last bits.
  std::vector<float> nearest_m;
  image::PixelMask covered;  ///< some splat covers it
  /// Covered, but no sample of that surface is near (PixelTest), or a pin-hole: a nearer surface is all around the
  /// pixel.
  image::PixelMask lacking;
  image::PixelMask edge;    ///< beside a step of depth or of the normal
  image::PixelMask strong;  ///< not an edge, but colour or normal differ much from a neighbour's
  image::PixelMask weak;    ///< the same, with a smaller difference
};

/// Renders the model and judges its pixels. threads: those of `keys`. rests: ViewKeys::begin().
void render_view_map(const points::PointModel& model, const geometry::Camera& camera, const PixelTest& test,
                     splat::ViewKeys& keys, ViewMap& map, bool rests = false);

/// Judges pixels tile by tile, for views that are searched in parts.
class PixelJudge {
 public:
  /// rim: from the ViewKeys that draw the tiles.
  PixelJudge(const geometry::Camera& camera, const PixelTest& test, const splat::RimBias& rim);
  /// Fills the part of `map` in which the tile lies: its first pixel is (x, y) there, x a multiple of 64. Masks must be
  /// zero there. Planes without pixels are left out. Threads may judge several tiles at a time if these share no
  /// word of a mask.
  void judge(const splat::ViewKeys::Tile& tile, int x, int y, ViewMap& map) const;

 private:
  struct Rows;
  // at: the place of (x0, y) in the map.
  void judge_64(const splat::ViewKeys::Tile& tile, Rows& rows, int x0, int y, const glm::ivec2& at, ViewMap& map) const;
  bool has_sample_near(const splat::ViewKeys::Tile& tile, int x, int y, float depth_m, uint16_t normal) const;
  float near_m_;
  splat::TangentPlanes planes_;
  PixelTest test_;
  BiasTable bias_;
};

/// Makes all masks zero, with this size.
void reset_masks(int width, int height, ViewMap& map);

}  // namespace telesplat::packer
