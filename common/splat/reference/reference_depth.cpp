#include "common/splat/reference/reference_depth.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/core/check.h"
#include "common/parallel/in_parallel.h"
#include "common/splat/facing.h"
#include "common/splat/item_figures.h"
#include "common/splat/reference/tangent_planes.h"
#include "common/splat/select/cluster_walk.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::splat {
namespace {

constexpr int kSpanWidth = 256, kSpanHeight = 256;  // 256 KiB of depths

// Adds the cluster's mosaics that may be seen, whole.
void add_items(const points::Cluster& cluster, std::span<const points::Mosaic> mosaics, const glm::vec3& eye,
               std::vector<DrawItem>& items) {
  const LeafView view = leaf_view(cluster.leaf_room, eye);
  for (const points::Mosaic& mosaic : mosaics) {
    if (mosaic.provisional()) continue;  // its points will be removed
    const Facing facing = facing_of(mosaic, view);
    if (facing == Facing::kAway) continue;
    items.push_back(
        {.cluster = &cluster, .level = mosaic.level(0), .splat_px = 1.0f, .may_face_away = facing == Facing::kMixed});
  }
}

std::vector<DrawItem> visible_items(const points::PointModel& model, const geometry::Camera& camera) {
  std::vector<DrawItem> items;
  const geometry::Frustum frustum(camera);
  const glm::vec3 eye(camera.pose.position_room);
  for (const SeenBrick& seen : seen_bricks(model, frustum, eye))
    for_seen_clusters(seen, frustum,
                      [&](const points::Cluster& cluster) { add_items(cluster, cluster.mosaics, eye, items); });
  return items;
}

// A view's points, sorted into tiles.
struct BinnedPoints {
  BinnedPoints(const std::vector<DrawItem>& all, const geometry::Camera& camera)
      : items(all),
        near_m(static_cast<float>(camera.near_m)),
        grid{camera.width, camera.height, kSpanWidth, kSpanHeight} {
    runs.build(items, camera);
    binning.build(grid, runs.transforms, near_m, 1.0f);
  }
  // Draws the points of a tile into `bits`, the depths of the tile's pixels.
  void draw(int index, uint32_t* bits) const {
    const geometry::Rect rect = grid.rect(index);
    depth_tile({rect, rect, near_m, binning.tile(index), runs.runs.data(), runs.transforms.data(), runs.facing.data(),
                items.data()},
               bits);
  }

  const std::vector<DrawItem>& items;
  const float near_m;
  const TileGrid grid;
  ItemRuns runs;
  TileBinning binning;
};

// Tests if the model has a point of a sample's surface in one of the pixels around the sample's: the second condition
// in eliminate_redundancy().
class NearPoints {
 public:
  NearPoints(const geometry::Camera& camera, std::span<const float> reference_depth_m, float relative_epsilon,
             float nearest)
      : planes_(camera),
        width_(camera.width),
        height_(camera.height),
        depth_scale_(static_cast<float>(camera.near_m * image::kMaxDepthCode)),
        relative_epsilon_(relative_epsilon),
        nearest2_(nearest * nearest),
        reference_m_(reference_depth_m) {}

  // True if the model shows a sample in pixel (px, py) of the frame.
  bool show(uint32_t depth_code, uint16_t normal, int px, int py) const {
    const float depth_m = depth_scale_ / static_cast<float>(depth_code), epsilon_m = relative_epsilon_ * depth_m;
    const PlaneSlope slope = planes_.at(normal, px, py);
    constexpr float kStep = 1.0f / (1 << kReferenceSubBits);
    constexpr uint32_t kPlace = (1u << kReferenceSubBits) - 1;
    const auto shown_at = [&](int dx, int dy) {
      const int qx = px + dx, qy = py + dy;
      if (qx < 0 || qy < 0 || qx >= width_ || qy >= height_) return false;
      const float reference = reference_m_[static_cast<size_t>(qy) * width_ + qx];
      if (!(reference < std::numeric_limits<float>::infinity())) return false;
      const uint32_t bits = std::bit_cast<uint32_t>(reference);
      const float ox = static_cast<float>(dx) + (static_cast<float>(bits & kPlace) + 0.5f) * kStep - 0.5f,
                  oy = static_cast<float>(dy) +
                       (static_cast<float>(bits >> kReferenceSubBits & kPlace) + 0.5f) * kStep - 0.5f;
      if (ox * ox + oy * oy > nearest2_) return false;
      return std::abs(reference - depth_m * (1.0f + slope.x * ox + slope.y * oy)) <= epsilon_m;
    };
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if ((dx != 0 || dy != 0) && shown_at(dx, dy)) return true;
    return false;
  }

 private:
  const TangentPlanes planes_;
  const int width_, height_;
  const float depth_scale_, relative_epsilon_, nearest2_;
  const std::span<const float> reference_m_;
};

void clear_pixel(image::DepthImage& image, size_t i) { image.depth[i] = 0, image.colour[i] = 0, image.normal[i] = 0; }

// Applies the second condition. Returns the number of cleared pixels.
uint64_t drop_near_points(const NearPoints& near, const geometry::Rect& tile, image::DepthImage& image) {
  uint64_t dropped = 0;
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; ++x) {
      const size_t i = static_cast<size_t>(y) * tile.width + x;
      if (image.depth[i] == 0 || !near.show(image.depth[i], image.normal[i], tile.x + x, tile.y + y)) continue;
      clear_pixel(image, i);
      ++dropped;
    }
  return dropped;
}

// A pixel is kept if depth < reference - epsilon * depth. With depth = near * kMaxDepthCode / code that is
// near * kMaxDepthCode * (1 + epsilon) < code * reference.
float numerator_of(const geometry::Camera& camera, float relative_epsilon) {
  return static_cast<float>(camera.near_m * image::kMaxDepthCode * (1.0 + relative_epsilon));
}

}  // namespace

void render_reference_depth(const points::PointModel& model, const geometry::Camera& camera, int threads,
                            std::vector<float>& depth_m) {
  depth_m.resize(static_cast<size_t>(camera.width) * camera.height);
  const std::vector<DrawItem> items = visible_items(model, camera);
  const BinnedPoints points(items, camera);
  const auto draw = [&](int index) {
    const geometry::Rect rect = points.grid.rect(index);
    std::vector<uint32_t> bits(static_cast<size_t>(rect.width) * rect.height,
                               std::bit_cast<uint32_t>(std::numeric_limits<float>::infinity()));
    points.draw(index, bits.data());
    for (int y = 0; y < rect.height; ++y)
      std::memcpy(depth_m.data() + static_cast<size_t>(rect.y + y) * camera.width + rect.x,
                  bits.data() + static_cast<size_t>(y) * rect.width, static_cast<size_t>(rect.width) * 4);
  };
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] { in_parallel(0, points.grid.count(), draw); });
}

void add_to_reference_depth(const points::PreparedPatch& patch, const points::ModelConfig& model,
                            const geometry::Camera& camera, std::vector<float>& depth_m) {
  CHECK(depth_m.size() == static_cast<size_t>(camera.width) * camera.height);
  const geometry::Frustum frustum(camera);
  const glm::vec3 eye(camera.pose.position_room);
  std::vector<points::Cluster> clusters(patch.mosaics.size());
  std::vector<DrawItem> items;
  for (size_t i = 0; i < clusters.size(); ++i) {
    const auto& [key, mosaic] = patch.mosaics[i];
    clusters[i].leaf_room = points::leaf_box(model, key);
    if (frustum.may_contain(clusters[i].leaf_room)) add_items(clusters[i], {&mosaic, 1}, eye, items);
  }
  if (items.empty()) return;
  const BinnedPoints points(items, camera);
  std::vector<uint32_t> bits(static_cast<size_t>(kSpanWidth) * kSpanHeight);
  for (int index = 0; index < points.grid.count(); ++index) {
    if (points.binning.tile(index).empty()) continue;
    const geometry::Rect rect = points.grid.rect(index);
    const auto row_of = [&](int y) { return depth_m.data() + static_cast<size_t>(rect.y + y) * camera.width + rect.x; };
    const size_t width = static_cast<size_t>(rect.width);
    for (int y = 0; y < rect.height; ++y) std::memcpy(bits.data() + y * width, row_of(y), width * 4);
    points.draw(index, bits.data());
    for (int y = 0; y < rect.height; ++y) std::memcpy(row_of(y), bits.data() + y * width, width * 4);
  }
}

Elimination eliminate_redundancy(const geometry::Camera& camera, const geometry::Rect& tile,
                                 const std::vector<float>& reference_depth_m, float relative_epsilon,
                                 image::DepthImage& image, float nearest) {
  CHECK(reference_depth_m.size() == static_cast<size_t>(camera.width) * camera.height);
  CHECK(image.width == tile.width && image.height == tile.height);
  CHECK(tile.x >= 0 && tile.y >= 0 && tile.x + tile.width <= camera.width && tile.y + tile.height <= camera.height);
  const float numerator = numerator_of(camera, relative_epsilon);
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
      // False if code is 0 (0 * infinity is NaN).
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
    result.kept -= drop_near_points({camera, reference_depth_m, relative_epsilon, nearest}, tile, image);
  return result;
}

Elimination eliminate_where_cast(const geometry::Camera& camera, const geometry::Rect& tile,
                                 const KnownReference& known, float relative_epsilon, image::DepthImage& image,
                                 float nearest) {
  const image::PixelMask& cast = known.cast;
  const std::span<const float> reference_depth_m = known.nearest_m;
  CHECK(reference_depth_m.size() == static_cast<size_t>(camera.width) * camera.height);
  CHECK(image.width == tile.width && image.height == tile.height);
  CHECK(cast.width() == tile.width && cast.height() == tile.height);
  CHECK(tile.x >= 0 && tile.y >= 0 && tile.x + tile.width <= camera.width && tile.y + tile.height <= camera.height);
  const float numerator = numerator_of(camera, relative_epsilon);
  const NearPoints near(camera, reference_depth_m, relative_epsilon, nearest);
  Elimination result;
  for (int y = 0; y < tile.height; ++y)
    image::for_each_set(cast.row(y), cast.words_per_row(), [&](size_t x) {
      const size_t i = static_cast<size_t>(y) * tile.width + x;
      const uint32_t code = image.depth[i];
      if (code == 0) return;
      ++result.samples;
      const int px = tile.x + static_cast<int>(x), py = tile.y + y;
      const float reference_m = reference_depth_m[static_cast<size_t>(py) * camera.width + px];
      const bool nearer = numerator < static_cast<float>(static_cast<int32_t>(code)) * reference_m;
      if (nearer && !(nearest > 0 && near.show(code, image.normal[i], px, py)))
        ++result.kept;
      else
        clear_pixel(image, i);
    });
  return result;
}

}  // namespace telesplat::splat
