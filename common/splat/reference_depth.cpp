#include "common/splat/reference_depth.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/core/check.h"
#include "common/splat/facing.h"
#include "common/splat/item_runs.h"
#include "common/splat/select/cluster_walk.h"
#include "common/splat/select/view_selection.h"
#include "common/splat/surfel/contour.h"

namespace telesplat::splat {
namespace {

constexpr int kTileWidth = 256, kTileHeight = 256;  // 256 KiB of depths

std::vector<DrawItem> visible_items(const points::PointModel& model, const geometry::Camera& camera) {
  std::vector<DrawItem> items;
  const geometry::Frustum frustum(camera);
  const glm::vec3 eye(camera.pose.position_room);
  for (const SeenBrick& seen : seen_bricks(model, frustum, eye))
    for_seen_clusters(seen, frustum, [&](const points::Cluster& cluster) {
      const LeafView view = leaf_view(cluster.leaf_room, eye);
      for (const points::Mosaic& mosaic : cluster.mosaics) {
        const Facing facing = facing_of(mosaic, view);
        if (facing == Facing::kAway) continue;
        items.push_back({.cluster = &cluster,
                         .level = mosaic.level(0),
                         .splat_px = 1.0f,
                         .may_face_away = facing == Facing::kMixed});
      }
    });
  return items;
}

// The depth of a sample's tangent plane from pixel to pixel: depth (1 + x dx + y dy) at an offset in pixels.
struct PlaneSlope {
  float x, y;
};

// Slopes are limited to those that splats follow (surfel/contour.h): normals are too coarse for more.
class TangentPlanes {
 public:
  explicit TangentPlanes(const geometry::Camera& camera) : c_(surfel_camera(camera)) {}
  PlaneSlope at(uint16_t normal, int x, int y) const {
    const auto [nx, ny, nz] = surfel_normal(normal);
    const float mx = dot(c_.right, nx, ny, nz), my = dot(c_.down, nx, ny, nz), mz = dot(c_.forward, nx, ny, nz);
    const float u = (static_cast<float>(x) + 0.5f - c_.centre_x) * c_.step_x,
                v = (static_cast<float>(y) + 0.5f - c_.centre_y) * c_.step_y;
    const float along = (mx * u + my * v) + mz;
    const float inverse = 1.0f / std::copysign(std::max(std::abs(along), 1e-3f), along);
    const float limit_x = kSteepest * c_.step_x, limit_y = kSteepest * c_.step_y;
    return {-std::clamp(mx * inverse * c_.step_x, -limit_x, limit_x),
            -std::clamp(my * inverse * c_.step_y, -limit_y, limit_y)};
  }

 private:
  SurfelCamera c_;
};

// The second condition of eliminate_redundancy. Returns how many pixels it cleared.
uint64_t drop_near_points(const geometry::Camera& camera, const geometry::Rect& tile,
                          const std::vector<float>& reference_depth_m, float relative_epsilon, float nearest,
                          image::DepthImage& image) {
  const TangentPlanes planes(camera);
  const auto depth_scale = static_cast<float>(camera.near_m * image::kMaxDepthCode);
  constexpr float kStep = 1.0f / (1 << kReferenceSubBits);
  constexpr uint32_t kPlace = (1u << kReferenceSubBits) - 1;
  const float nearest2 = nearest * nearest;
  uint64_t dropped = 0;
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; ++x) {
      const size_t i = static_cast<size_t>(y) * tile.width + x;
      if (image.depth[i] == 0) continue;
      const int px = tile.x + x, py = tile.y + y;
      const float depth_m = depth_scale / static_cast<float>(image.depth[i]), epsilon_m = relative_epsilon * depth_m;
      const PlaneSlope slope = planes.at(image.normal[i], px, py);
      const auto shown_at = [&](int dx, int dy) {
        const int qx = px + dx, qy = py + dy;
        if (qx < 0 || qy < 0 || qx >= camera.width || qy >= camera.height) return false;
        const float reference = reference_depth_m[static_cast<size_t>(qy) * camera.width + qx];
        if (!(reference < std::numeric_limits<float>::infinity())) return false;
        const uint32_t bits = std::bit_cast<uint32_t>(reference);
        const float ox = static_cast<float>(dx) + (static_cast<float>(bits & kPlace) + 0.5f) * kStep - 0.5f,
                    oy = static_cast<float>(dy) +
                         (static_cast<float>(bits >> kReferenceSubBits & kPlace) + 0.5f) * kStep - 0.5f;
        if (ox * ox + oy * oy > nearest2) return false;
        return std::abs(reference - depth_m * (1.0f + slope.x * ox + slope.y * oy)) <= epsilon_m;
      };
      bool shown = false;
      for (int dy = -1; dy <= 1 && !shown; ++dy)
        for (int dx = -1; dx <= 1 && !shown; ++dx) shown = (dx != 0 || dy != 0) && shown_at(dx, dy);
      if (!shown) continue;
      image.depth[i] = 0, image.colour[i] = 0, image.normal[i] = 0;
      ++dropped;
    }
  return dropped;
}

}  // namespace

void render_reference_depth(const points::PointModel& model, const geometry::Camera& camera, int threads,
                            std::vector<float>& depth_m) {
  const TileGrid grid{camera.width, camera.height, kTileWidth, kTileHeight};
  depth_m.resize(static_cast<size_t>(camera.width) * camera.height);
  const std::vector<DrawItem> items = visible_items(model, camera);
  ItemRuns runs;
  runs.build(items, camera);
  TileBinning binning;
  binning.build(grid, runs.transforms, static_cast<float>(camera.near_m), 1.0f);

  const auto draw = [&](int index) {
    const geometry::Rect rect = grid.rect(index);
    std::vector<uint32_t> bits(static_cast<size_t>(rect.width) * rect.height,
                               std::bit_cast<uint32_t>(std::numeric_limits<float>::infinity()));
    const TileInput input{rect,
                          rect,
                          static_cast<float>(camera.near_m),
                          binning.tile(index),
                          runs.runs.data(),
                          runs.transforms.data(),
                          runs.facing.data(),
                          items.data()};
    depth_tile(input, bits.data());
    for (int y = 0; y < rect.height; ++y)
      std::memcpy(depth_m.data() + static_cast<size_t>(rect.y + y) * camera.width + rect.x,
                  bits.data() + static_cast<size_t>(y) * rect.width, static_cast<size_t>(rect.width) * 4);
  };
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] { tbb::parallel_for(0, grid.count(), draw); });
}

Elimination eliminate_redundancy(const geometry::Camera& camera, const geometry::Rect& tile,
                                 const std::vector<float>& reference_depth_m, float relative_epsilon,
                                 image::DepthImage& image, float nearest) {
  CHECK(reference_depth_m.size() == static_cast<size_t>(camera.width) * camera.height);
  CHECK(image.width == tile.width && image.height == tile.height);
  CHECK(tile.x >= 0 && tile.y >= 0 && tile.x + tile.width <= camera.width && tile.y + tile.height <= camera.height);
  // A pixel is kept if depth < reference - epsilon * depth. With depth = near * kMaxDepthCode / code that is
  // near * kMaxDepthCode * (1 + epsilon) < code * reference.
  const auto numerator = static_cast<float>(camera.near_m * image::kMaxDepthCode * (1.0 + relative_epsilon));
  Elimination result;
  for (int y = 0; y < tile.height; ++y) {
    const float* reference = reference_depth_m.data() + static_cast<size_t>(tile.y + y) * camera.width + tile.x;
    const size_t row = static_cast<size_t>(y) * tile.width;
    uint32_t* depth = image.depth.data() + row;
    uint32_t* colour = image.colour.data() + row;
    uint16_t* normal = image.normal.data() + row;
    uint32_t samples = 0, kept = 0;
    for (int x = 0; x < tile.width; ++x) {
      const uint32_t code = depth[x];
      // Where code is 0 this is false (0 * infinity is not a number).
      const bool keep = numerator < static_cast<float>(static_cast<int32_t>(code)) * reference[x];
      const uint32_t mask = keep ? ~0u : 0u;
      samples += code != 0;
      kept += keep;
      depth[x] &= mask;
      colour[x] &= mask;
      normal[x] &= static_cast<uint16_t>(mask);
    }
    result.samples += samples;
    result.kept += kept;
  }
  if (nearest > 0 && result.kept > 0)
    result.kept -= drop_near_points(camera, tile, reference_depth_m, relative_epsilon, nearest, image);
  return result;
}

}  // namespace telesplat::splat
