#include "common/splat/cpu_splatter.h"

#include <hwy/aligned_allocator.h>
#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/core/machine.h"
#include "common/parallel/crew.h"
#include "common/splat/backdrop.h"
#include "common/splat/finish.h"
#include "common/splat/item_figures.h"
#include "common/splat/tile_work.h"

namespace telesplat::splat {
namespace {

constexpr int kMargin = kMaxSplatSide;
constexpr size_t kRunsAtOnce = 512;
constexpr int kRowsAtOnce = 32;  // rows that are doubled
constexpr size_t kBoxesAhead = 8;

// Layout of the keys of a full-size tile, of the pixels in its reach, and of the margin for splats that hang over.
struct Layout {
  int width = 0, height = 0;  // size of a tile; 0: none yet
  int reach = 0;

  int stride() const { return width + 2 * (reach + kMargin); }
  size_t size() const { return static_cast<size_t>(stride()) * (height + 2 * (reach + kMargin)); }
  bool operator==(const Layout&) const = default;
  ResolvedTile tile(uint64_t* keys, const geometry::Rect& rect) const {
    return {reinterpret_cast<uint32_t*>(keys), stride(), reach + kMargin, rect.width, rect.height};
  }
};

// Buffers of one thread, kept from frame to frame.
struct Workspace {
  hwy::AlignedFreeUniquePtr<uint64_t[]> keys;
  Layout layout;  // layout of `keys`
  EwaBuffer ewa;
  std::vector<uint64_t> row;
  FinishScratch finish;
  SplatStats stats;
};

geometry::Rect grown(const geometry::Rect& r, int by) {
  return {r.x - by, r.y - by, r.width + 2 * by, r.height + 2 * by};
}

// Empties the pixels to the right of and below a tile that the image's edge cuts. Splats hang over into them, and a
// whole tile needs them empty.
void empty_beyond(const ResolvedTile& tile, const Layout& layout) {
  const int reach = layout.reach, right = tile.width + reach, lower = tile.height + reach;
  const auto fill = [&](int y, int x0) {
    std::fill(tile.key(y) + x0, tile.key(y) + layout.width + reach, static_cast<uint64_t>(kEmptyKey));
  };
  for (int y = -reach; y < lower; ++y) fill(y, right);
  for (int y = lower; y < std::min(lower + kMargin, layout.height + reach); ++y) fill(y, -reach);
}

void write_background(const geometry::Rect& rect, uint32_t background, const TileTarget& target) {
  for (int y = 0; y < rect.height; ++y) {
    std::fill_n(target.colour + y * target.pitch, rect.width, 0xff000000u | background);
    if (target.depth_m)
      std::fill_n(target.depth_m + y * target.pitch, rect.width, std::numeric_limits<float>::infinity());
  }
}

// Data prepared for one view.
struct Sight {
  SurfelInput surfels;
  std::vector<SurfelSource> sources;
  EwaLight light;
  ResolveInput resolve;
  ItemRuns runs;
  std::vector<ItemStyle> styles;
  /// Reach of the largest splat from its centre, pixels. Surfels reach reach_of() farther.
  float overhang = 0;
  TileBinning binning;
  Backdrop backdrop;
  bool has_backdrop = false;
};

}  // namespace

struct CpuSplatter::Impl {
  explicit Impl(std::shared_ptr<Crew> threads)
      : shared(std::move(threads)), crew(*shared), workspaces(static_cast<size_t>(crew.threads())) {}

  void prepare(const DrawList& list, std::span<const geometry::Camera> cameras, const RenderOptions& options,
               const image::Shading& shading);
  void prepare_items(const DrawList& list, const geometry::Camera& camera, Sight& sight);
  void bin(const DrawList& list, const geometry::Camera& camera, Sight& sight);
  float reach_of(const DrawList& list, const ItemRun& run, const Sight& sight) const;
  TileCounts splat(const TileInput& input, const ResolvedTile& tile, const Sight& sight, Workspace& workspace);
  void draw_tile(int index, const DrawList& list, const Sight& sight, const FrameTarget& target, Workspace& workspace);
  void finish_tile(const ResolvedTile& tile, const geometry::Rect& rect, const Sight& sight, Workspace& workspace);
  SplatStats render(const DrawList& list, std::span<const geometry::Camera> cameras, const RenderOptions& options,
                    const image::Shading& shading, std::span<const FrameTarget> targets);
  SplatStats render_halved(const DrawList& list, const geometry::Camera& camera, const RenderOptions& options,
                           const image::Shading& shading, const FrameTarget& target);

  std::shared_ptr<Crew> shared;
  Crew& crew;
  std::vector<Workspace> workspaces;
  BackdropPainter painter;

  // The frame.
  const KernelTraits* kernel = nullptr;
  Finish finish;
  Layout layout;
  SplatTable table;
  TileGrid grid;
  std::array<Sight, 2> sights;
  std::vector<uint8_t> intensity = std::vector<uint8_t>(65536 + 3);
  std::vector<uint32_t> half_colour;  // colours of a halved frame, before it is doubled
  std::vector<float> half_depth_m;
};

void CpuSplatter::Impl::prepare(const DrawList& list, std::span<const geometry::Camera> cameras,
                                const RenderOptions& options, const image::Shading& shading) {
  const geometry::Camera& first = cameras.front();
  kernel = &traits_of(options.kernel);
  finish = options.finish;
  layout = {kernel->tile_width, kernel->tile_height, finish_reach(finish)};
  grid = {first.width, first.height, layout.width, layout.height};
  std::memcpy(intensity.data(), shading.table().data(), shading.table().size());
  if (!kernel->surfel) table.set_focal(first.focal_x());
  for (size_t i = 0; i < cameras.size(); ++i) {
    Sight& sight = sights[i];
    sight.resolve = {intensity.data(), shading.background(), static_cast<float>(cameras[i].near_m), {}};
    if (kernel->surfel) {
      sight.surfels = {surfel_camera(cameras[i]), nullptr, spacing_limits(list.scale), widest_contour(cameras[i])};
      sight.light = ewa_light(shading.parameters(), sight.surfels.camera);
      sight.light.background = shading.background();
    }
    if (i == 0 || kernel->surfel) {
      prepare_items(list, cameras[i], sight);
    } else {  // flat splats are the same for both cameras
      sight.styles = sights[0].styles;
      sight.overhang = sights[0].overhang;
      sight.resolve.rim = sights[0].resolve.rim;
    }
    if (i == 0)
      sight.runs.build(list.items);
    else
      sight.runs.like(sights[0].runs);
    bin(list, cameras[i], sight);
  }
}

void CpuSplatter::Impl::prepare_items(const DrawList& list, const geometry::Camera& camera, Sight& sight) {
  FrameFigures figures(*kernel, camera, list.scale);
  sight.overhang = kernel->reach.least_px;
  if (kernel->surfel) {
    sight.sources.resize(list.items.size());
    for (size_t i = 0; i < list.items.size(); ++i) sight.sources[i] = figures.add(list.items[i]).source;
    sight.surfels.sources = sight.sources.data();
  } else {
    sight.styles.resize(list.items.size());
    for (size_t i = 0; i < list.items.size(); ++i) {
      const ItemFigures item = figures.add(list.items[i]);
      sight.styles[i] = {&table.shape(*kernel, *item.flat), item.spacing};
      sight.overhang = std::max(sight.overhang, 0.5f * static_cast<float>(item.flat->side) + 0.5f);
    }
  }
  sight.resolve.rim = figures.rim();
}

void CpuSplatter::Impl::bin(const DrawList& list, const geometry::Camera& camera, Sight& sight) {
  ItemRuns& runs = sight.runs;
  sight.binning.begin(grid, runs.runs.size(), sight.resolve.near_m, static_cast<float>(layout.reach) + sight.overhang);
  const auto room_to_pixel = camera.room_to_pixel();
  const glm::vec3 eye(camera.pose.position_room);
  const size_t count = runs.runs.size();
  crew.run((count + kRunsAtOnce - 1) / kRunsAtOnce, [&](size_t part, int) {
    const size_t last = std::min((part + 1) * kRunsAtOnce, count);
    for (size_t i = part * kRunsAtOnce; i < last; ++i) {
      // Prefetches: clusters lie scattered in memory.
      if (i + kBoxesAhead < last) hwy::Prefetch(&list.items[runs.runs[i + kBoxesAhead].first].cluster->leaf_room);
      runs.transform(i, list.items, room_to_pixel, eye);
      sight.binning.place(i, runs.transforms[i], reach_of(list, runs.runs[i], sight), static_cast<float>(kMargin));
    }
  });
  sight.binning.list();
}

// Reach of a run's contours, in pixels times depth. With bins grown by kMargin for all splats, each point was processed
// 1.63 times at 256 x 256 (bench splat_ellipse).
float CpuSplatter::Impl::reach_of(const DrawList& list, const ItemRun& run, const Sight& sight) const {
  if (!kernel->surfel) return 0;
  float radius_m = 0;
  for (uint32_t i = run.first; i < run.last; ++i) radius_m = std::max(radius_m, list.items[i].radius_m);
  return kernel->reach.growth * sight.surfels.widest * radius_m;
}

TileCounts CpuSplatter::Impl::splat(const TileInput& input, const ResolvedTile& tile, const Sight& sight,
                                    Workspace& workspace) {
  return kernel->splat_tile({.input = input,
                             .styles = sight.styles.data(),
                             .surfels = sight.surfels,
                             .light = sight.light,
                             .keys = {workspace.keys.get(), tile.stride, kMargin},
                             .tile = tile,
                             .reach = layout.reach,
                             .ewa = workspace.ewa});
}

void CpuSplatter::Impl::finish_tile(const ResolvedTile& tile, const geometry::Rect& rect, const Sight& sight,
                                    Workspace& workspace) {
  SplatStats& stats = workspace.stats;
  double start = monotonic_s();
  const auto lap = [&](double& ms) {
    const double now = monotonic_s();
    ms += (now - start) * 1e3;
    start = now;
  };
  ResolvedTile content = crop_to_content(tile, layout.reach);
  const bool empty = content.width == 0 || content.height == 0;
  if (empty && !sight.has_backdrop) return;
  // Each stage writes as many pixels around the tile as later stages read.
  const int left_after_fill = finish_reach({false, finish.smooth, finish.antialias});
  const int left_after_smooth = finish_reach({false, false, finish.antialias});
  if (finish.fill && !empty)
    fill_holes(content, left_after_fill, gaps_to_fill(finish), workspace.finish), lap(stats.fill_ms);
  if (sight.has_backdrop) {
    fill_from(sight.backdrop, rect, sight.resolve.near_m, tile, left_after_fill);
    content = tile;
    lap(stats.resolve_ms);
  }
  if (finish.smooth) smooth(content, left_after_smooth, workspace.finish), lap(stats.smooth_ms);
  if (finish.antialias) antialias(content, workspace.finish), lap(stats.antialias_ms);
}

void CpuSplatter::Impl::draw_tile(int index, const DrawList& list, const Sight& sight, const FrameTarget& target,
                                  Workspace& workspace) {
  const ItemRuns& runs = sight.runs;
  const ResolveInput& resolve = sight.resolve;
  const geometry::Rect rect = grid.rect(index);
  const size_t first = static_cast<size_t>(rect.y) * target.row() + static_cast<size_t>(rect.x);
  const TileTarget out{target.colour + first, target.depth_m ? target.depth_m + first : nullptr, target.row()};
  const auto entries = sight.binning.tile(index);
  SplatStats& stats = workspace.stats;
  const double start = monotonic_s();
  if (entries.empty() && !sight.has_backdrop) {
    write_background(rect, resolve.background, out);
    stats.resolve_ms += (monotonic_s() - start) * 1e3;
    return;
  }

  // Buffers are empty between tiles: writing a tile empties them, except their margins.
  const ResolvedTile tile = layout.tile(workspace.keys.get(), rect);
  const TileInput input{grown(rect, layout.reach),
                        rect,
                        resolve.near_m,
                        entries,
                        runs.runs.data(),
                        runs.transforms.data(),
                        runs.facing.data(),
                        list.items.data()};
  const TileCounts counts = splat(input, tile, sight, workspace);
  stats.points_projected += counts.projected;
  stats.points_drawn += counts.drawn;
  const double splatted = monotonic_s();
  stats.project_ms += (splatted - start) * 1e3;

  double finished = splatted;
  const bool resolved = kernel->passes == Passes::kSums;
  if (layout.reach == 0 && !resolved && !sight.has_backdrop) {
    resolve_and_write_tile(tile, resolve, out);
  } else {
    if (!resolved) resolve_tile(tile, layout.reach, resolve, workspace.row);
    stats.resolve_ms += (monotonic_s() - splatted) * 1e3;
    finish_tile(tile, rect, sight, workspace);
    finished = monotonic_s();
    write_tile(tile, layout.reach, resolve, out);
  }
  if (rect.width < layout.width || rect.height < layout.height) empty_beyond(tile, layout);
  stats.resolve_ms += (monotonic_s() - finished) * 1e3;
}

CpuSplatter::CpuSplatter(int threads)
    : impl_(std::make_unique<Impl>(std::make_shared<Crew>(threads > 0 ? threads : usable_processors()))) {}
CpuSplatter::~CpuSplatter() = default;

SplatStats& SplatStats::operator+=(const SplatStats& other) {
  points_projected += other.points_projected, points_drawn += other.points_drawn;
  prepare_ms += other.prepare_ms, project_ms += other.project_ms, resolve_ms += other.resolve_ms;
  fill_ms += other.fill_ms, smooth_ms += other.smooth_ms, antialias_ms += other.antialias_ms;
  return *this;
}

SplatStats CpuSplatter::Impl::render(const DrawList& list, std::span<const geometry::Camera> cameras,
                                     const RenderOptions& options, const image::Shading& shading,
                                     std::span<const FrameTarget> targets) {
  for (size_t i = 0; i < cameras.size(); ++i)
    CHECK(targets[i].width == cameras[i].width && targets[i].height == cameras[i].height && targets[i].colour);
  SplatStats sum;
  const double start = monotonic_s();
  for (size_t i = 0; i < cameras.size(); ++i) {
    sights[i].has_backdrop = has_base(list);
    if (has_base(list)) painter.paint(*list.base, list.base_clip, cameras[i], shading, crew, sights[i].backdrop);
  }
  prepare(list, cameras, options, shading);
  const double prepare_ms = (monotonic_s() - start) * 1e3;
  for (Workspace& w : workspaces) {
    // Empties all of a new layout; later, every tile leaves its pixels empty.
    if (w.layout != layout) {
      w.keys = hwy::AllocateAligned<uint64_t>(layout.size());
      std::fill_n(w.keys.get(), layout.size(), static_cast<uint64_t>(kEmptyKey));
      w.layout = layout;
    }
    w.stats = {};
  }
  const auto count = static_cast<size_t>(grid.count());
  crew.run(count * cameras.size(), [&](size_t tile, int thread) {
    const size_t view = tile / count;
    draw_tile(static_cast<int>(tile % count), list, sights[view], targets[view],
              workspaces[static_cast<size_t>(thread)]);
  });
  sum.prepare_ms += prepare_ms;
  for (const Workspace& w : workspaces) sum += w.stats;
  return sum;
}

SplatStats CpuSplatter::Impl::render_halved(const DrawList& list, const geometry::Camera& camera,
                                            const RenderOptions& options, const image::Shading& shading,
                                            const FrameTarget& target) {
  const geometry::Camera small = geometry::half_size(camera);
  half_colour.resize(static_cast<size_t>(small.width) * static_cast<size_t>(small.height));
  if (target.depth_m) half_depth_m.resize(half_colour.size());
  const FrameTarget half{small.width, small.height, half_colour.data(), target.depth_m ? half_depth_m.data() : nullptr};
  SplatStats stats = render(list, {&small, 1}, options, shading, {&half, 1});
  const double start = monotonic_s();
  crew.run(static_cast<size_t>((target.height + kRowsAtOnce - 1) / kRowsAtOnce), [&](size_t part, int) {
    const int first = static_cast<int>(part) * kRowsAtOnce;
    double_rows(half, target, first, std::min(first + kRowsAtOnce, target.height));
  });
  stats.resolve_ms += (monotonic_s() - start) * 1e3 * crew.threads();
  return stats;
}

SplatStats CpuSplatter::render(const DrawList& list, const geometry::Camera& camera, const RenderOptions& options,
                               const image::Shading& shading, const FrameTarget& target) {
  if (options.halved) return impl_->render_halved(list, camera, options, shading, target);
  return impl_->render(list, {&camera, 1}, options, shading, {&target, 1});
}

SplatStats CpuSplatter::render_pair(const DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                                    const RenderOptions& options, const image::Shading& shading,
                                    const std::array<FrameTarget, 2>& targets) {
  CHECK(cameras[0].width == cameras[1].width && cameras[0].height == cameras[1].height &&
        cameras[0].near_m == cameras[1].near_m);
  return impl_->render(list, cameras, options, shading, targets);
}

}  // namespace telesplat::splat
