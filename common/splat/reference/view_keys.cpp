#include "common/splat/reference/view_keys.h"

#include <hwy/aligned_allocator.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <vector>

#include "common/parallel/in_parallel.h"
#include "common/splat/facing.h"
#include "common/splat/item_figures.h"
#include "common/splat/select/cluster_walk.h"

namespace telesplat::splat {
namespace {

constexpr int kKeyMargin = kMaxSplatSide, kReach = ViewKeys::kReach;
constexpr size_t kMaxVectorPixels = 64;  // readers by vectors read at most this many pixels beyond a row
constexpr uint32_t kNothing = std::bit_cast<uint32_t>(std::numeric_limits<float>::infinity());

// Buffers of one thread, kept from view to view. Keys are empty between tiles, except for the margin into which splats
// hang over.
struct KeyWorkspace {
  hwy::AlignedFreeUniquePtr<uint64_t[]> keys;
  std::vector<uint32_t> depth_bits;
  int width = 0, height = 0;  // size of a tile with its reach; 0: none yet

  int stride() const { return width + 2 * kKeyMargin; }
  void resize(int tile_width, int tile_height) {
    const int w = tile_width + 2 * kReach, h = tile_height + 2 * kReach;
    if (w == width && h == height) return;
    width = w, height = h;
    const size_t size = static_cast<size_t>(stride()) * (height + 2 * kKeyMargin);
    keys = hwy::AllocateAligned<uint64_t>(size);
    std::fill_n(keys.get(), size, static_cast<uint64_t>(kEmptyKey));
    depth_bits.resize(static_cast<size_t>(width) * height + kMaxVectorPixels);
  }
  void empty() {
    for (int y = 0; y < height; ++y)
      std::fill_n(keys.get() + static_cast<size_t>(y + kKeyMargin) * stride() + kKeyMargin, width,
                  static_cast<uint64_t>(kEmptyKey));
  }
};

// Chooses every mosaic that may be seen, whole, with splats as large as its own samples' distance.
class Chooser {
 public:
  Chooser(const geometry::Camera& camera, bool rests)
      : camera_(camera), eye_(camera.pose.position_room), rests_(rests) {}

  void add(const points::Cluster& cluster, std::vector<DrawItem>& items, uint64_t& points) const {
    const LeafView view = leaf_view(cluster.leaf_room, eye_);
    const double leaf_m = double{cluster.leaf_room.hi.x} - double{cluster.leaf_room.lo.x};
    const float range = points::pixel_range(camera_, cluster.leaf_room.centre(), leaf_m);
    for (const points::Mosaic& mosaic : cluster.mosaics) {
      if (mosaic.provisional() && !(rests_ && mosaic.of_rest())) continue;  // its points will be removed
      const Facing facing = facing_of(mosaic, view);
      if (facing == Facing::kAway) continue;
      const float px = std::min(kClosedScale * range / mosaic.pixel_range(), static_cast<float>(kMaxSplatSide));
      items.push_back({.cluster = &cluster,
                       .level = mosaic.level(0),
                       .splat_px = std::max(px, 1.0f),
                       .may_face_away = facing == Facing::kMixed});
      points += mosaic.count(0);
    }
  }

 private:
  const geometry::Camera& camera_;
  const glm::vec3 eye_;
  const bool rests_;
};

}  // namespace

// Discs on the screen take two thirds of the time of ellipses on the surface. They find the same pixels that lack
// something, except for a twentieth of those at edges (a terrain of 2.5 million points at 2560x1600).
constexpr Kernel kKernel = Kernel::kDisc;

struct ViewKeys::Impl {
  explicit Impl(int threads)
      : arena(threads > 0 ? threads : tbb::task_arena::automatic),
        workspaces(static_cast<size_t>(arena.max_concurrency())) {}

  void choose(const points::PointModel& model, const geometry::Camera& camera, bool rests);
  void bin(const geometry::Camera& camera);
  void draw_tile(int index, KeyWorkspace& workspace, const std::function<void(const Tile&)>& visit);

  tbb::task_arena arena;
  std::vector<KeyWorkspace> workspaces;

  // The view.
  TileGrid grid;
  float near_m = 0;
  std::vector<DrawItem> items;
  std::vector<ItemStyle> styles;
  SplatTable table;
  float overhang = 0;  // reach of the largest splat from its centre, pixels
  ItemRuns runs;
  TileBinning binning;
  RimBias rim{};
  uint64_t points = 0;
};

void ViewKeys::Impl::choose(const points::PointModel& model, const geometry::Camera& camera, bool rests) {
  items.clear();
  points = 0;
  const geometry::Frustum frustum(camera);
  const Chooser chooser(camera, rests);
  for (const SeenBrick& seen : seen_bricks(model, frustum, glm::vec3(camera.pose.position_room)))
    for_seen_clusters(seen, frustum, [&](const points::Cluster& cluster) { chooser.add(cluster, items, points); });
  FrameFigures figures(traits_of(kKernel), camera, kClosedScale);
  table.set_focal(camera.focal_x());
  styles.resize(items.size());
  overhang = 0;
  for (size_t i = 0; i < items.size(); ++i) {
    const ItemFigures item = figures.add(items[i]);
    styles[i] = {&table.shape(traits_of(kKernel), *item.flat), item.spacing};
    overhang = std::max(overhang, 0.5f * static_cast<float>(item.flat->side) + 0.5f);
  }
  rim = figures.rim();
}

void ViewKeys::Impl::bin(const geometry::Camera& camera) {
  runs.build(items);
  binning.begin(grid, runs.runs.size(), near_m, static_cast<float>(kReach) + overhang);
  const auto room_to_pixel = camera.room_to_pixel();
  const glm::vec3 eye(camera.pose.position_room);
  arena.execute([&] {
    in_parallel(tbb::blocked_range<size_t>(0, runs.runs.size(), 512), [&](const tbb::blocked_range<size_t>& r) {
      for (size_t i = r.begin(); i < r.end(); ++i) {
        runs.transform(i, items, room_to_pixel, eye);
        binning.place(i, runs.transforms[i]);
      }
    });
  });
  binning.list();
}

void ViewKeys::Impl::draw_tile(int index, KeyWorkspace& w, const std::function<void(const Tile&)>& visit) {
  Tile tile{.index = index, .rect = grid.rect(index)};
  const auto entries = binning.tile(index);
  if (entries.empty()) return visit(tile);
  const geometry::Rect& r = tile.rect;
  const geometry::Rect around{r.x - kReach, r.y - kReach, r.width + 2 * kReach, r.height + 2 * kReach};
  const TileInput input{around,      r, near_m, entries, runs.runs.data(), runs.transforms.data(), runs.facing.data(),
                        items.data()};
  splat_tile(input, styles.data(), {w.keys.get(), w.stride(), kKeyMargin});
  std::fill_n(w.depth_bits.data(), static_cast<size_t>(around.width) * around.height, kNothing);
  depth_tile(input, w.depth_bits.data());
  tile.empty = false;
  tile.key_stride = w.stride();
  tile.keys = w.keys.get() + static_cast<ptrdiff_t>(kKeyMargin + kReach) * w.stride() + kKeyMargin + kReach;
  tile.depth_stride = around.width;
  tile.depth_bits = w.depth_bits.data() + static_cast<ptrdiff_t>(kReach) * around.width + kReach;
  visit(tile);
  w.empty();
}

ViewKeys::ViewKeys(int threads) : impl_(std::make_unique<Impl>(threads)) {}
ViewKeys::~ViewKeys() = default;

void ViewKeys::begin(const points::PointModel& model, const geometry::Camera& camera, int tile_width, int tile_height,
                     bool rests) {
  Impl& m = *impl_;
  m.grid = {camera.width, camera.height, tile_width, tile_height};
  m.near_m = static_cast<float>(camera.near_m);
  m.choose(model, camera, rests);
  m.bin(camera);
  for (KeyWorkspace& w : m.workspaces) w.resize(tile_width, tile_height);
}

const TileGrid& ViewKeys::grid() const { return impl_->grid; }
const RimBias& ViewKeys::rim() const { return impl_->rim; }
uint64_t ViewKeys::points() const { return impl_->points; }

void ViewKeys::draw(std::span<const int> tiles, const std::function<void(const Tile&)>& visit) {
  Impl& m = *impl_;
  m.arena.execute([&] {
    in_parallel(
        tbb::blocked_range<size_t>(0, tiles.size(), 1),
        [&](const tbb::blocked_range<size_t>& range) {
          KeyWorkspace& workspace = m.workspaces[static_cast<size_t>(thread_in_loop())];
          for (size_t i = range.begin(); i < range.end(); ++i) m.draw_tile(tiles[i], workspace, visit);
        },
        tbb::simple_partitioner());
  });
}

void ViewKeys::draw_all(const std::function<void(const Tile&)>& visit) {
  std::vector<int> all(static_cast<size_t>(impl_->grid.count()));
  std::iota(all.begin(), all.end(), 0);
  draw(all, visit);
}

}  // namespace telesplat::splat
