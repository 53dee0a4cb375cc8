#include "common/splat/reference_depth.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/core/check.h"
#include "common/splat/item_runs.h"
#include "common/splat/view_selection.h"

namespace telesplat::splat {
namespace {

constexpr int kTileWidth = 256, kTileHeight = 256;  // 256 KiB of depths

std::vector<DrawItem> visible_items(const points::PointModel& model, const geometry::Camera& camera) {
  std::vector<DrawItem> items;
  const geometry::Frustum frustum(camera);
  const glm::vec3 eye(camera.pose.position_room);
  for (const auto& [key, cluster] : model.clusters()) {
    if (!frustum.may_contain(cluster->leaf_room)) continue;
    for (const points::Mosaic& mosaic : cluster->mosaics)
      if (!faces_away(mosaic, cluster->leaf_room, eye)) items.push_back({cluster.get(), mosaic.level(0), 1.0f});
  }
  return items;
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
                                 image::DepthImage& image) {
  CHECK(reference_depth_m.size() == static_cast<size_t>(camera.width) * camera.height);
  CHECK(image.width == tile.width && image.height == tile.height);
  CHECK(tile.x >= 0 && tile.y >= 0 && tile.x + tile.width <= camera.width && tile.y + tile.height <= camera.height);
  // depth = numerator / code; kept if depth < reference - epsilon * depth, that is, if numerator * (1 + epsilon) < code * reference.
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
  return result;
}

}  // namespace telesplat::splat
