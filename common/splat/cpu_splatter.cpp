#include "common/splat/cpu_splatter.h"

#include <hwy/aligned_allocator.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstring>

#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/splat/item_runs.h"
#include "common/splat/splat_kernels.h"

namespace telesplat::splat {
namespace {

// Set by bench splat_square, 3 pixels: 14.9 ms at 512 x 64, 13.6 ms at 256 x 128 and 512 x 128, 13.2 ms here (more short rows mean
// more clusters that straddle tiles). 512 KiB of keys.
constexpr int kTileWidth = 256, kTileHeight = 256;

// What one thread needs, kept from frame to frame.
struct Workspace {
  hwy::AlignedFreeUniquePtr<uint64_t[]> keys;
  size_t size = 0;
  SplatStats stats;
};

// Empties what splats wrote to the right of and below a tile that the image's edge cuts: in a whole tile those are pixels.
void empty_beyond(const KeyBuffer& buffer, const geometry::Rect& rect) {
  const auto fill = [&](int y, int x0, int x1) {
    uint64_t* row = buffer.keys + static_cast<size_t>(y + buffer.margin) * buffer.stride + buffer.margin;
    std::fill(row + x0, row + x1, static_cast<uint64_t>(kEmptyKey));
  };
  for (int y = 0; y < rect.height; ++y) fill(y, rect.width, rect.width + buffer.margin);
  for (int y = rect.height; y < rect.height + buffer.margin; ++y) fill(y, 0, rect.width + buffer.margin);
}

}  // namespace

struct CpuSplatter::Impl {
  explicit Impl(int threads)
      : arena(threads > 0 ? threads : tbb::task_arena::automatic),
        workspaces(static_cast<size_t>(arena.max_concurrency())) {}

  void prepare(const DrawList& list, const geometry::Camera& camera, Kernel kernel, const image::Shading& shading);
  void draw_tile(int index, const DrawList& list, const geometry::Camera& camera, const image::Shading& shading,
                 const FrameTarget& target, Workspace& workspace);

  tbb::task_arena arena;
  std::vector<Workspace> workspaces;
  SplatTable table;
  TileGrid grid;
  ItemRuns runs;
  std::vector<const SplatShape*> shapes;
  TileBinning binning;
  std::vector<uint8_t> intensity = std::vector<uint8_t>(65536 + 3);
  int margin = 4;  // of the tiles' buffers: the widest row of all shapes in this frame
};

void CpuSplatter::Impl::prepare(const DrawList& list, const geometry::Camera& camera, Kernel kernel,
                                const image::Shading& shading) {
  grid = {camera.width, camera.height, kTileWidth, kTileHeight};
  std::memcpy(intensity.data(), shading.table().data(), shading.table().size());
  table.set_focal(camera.focal_x());
  shapes.resize(list.items.size());
  margin = 4;
  for (size_t i = 0; i < list.items.size(); ++i) {
    shapes[i] = &table.shape(kernel, list.items[i].splat_px);
    margin = std::max(margin, shapes[i]->row_stride);
  }
  runs.build(list.items, camera);
  binning.build(grid, runs.transforms, static_cast<float>(camera.near_m), static_cast<float>(margin));
}

void CpuSplatter::Impl::draw_tile(int index, const DrawList& list, const geometry::Camera& camera,
                                  const image::Shading& shading, const FrameTarget& target, Workspace& workspace) {
  const geometry::Rect rect = grid.rect(index);
  uint32_t* colour = target.colour + static_cast<size_t>(rect.y) * target.width + rect.x;
  float* depth = target.depth_m ? target.depth_m + static_cast<size_t>(rect.y) * target.width + rect.x : nullptr;
  const auto entries = binning.tile(index);
  const double start = monotonic_s();

  // Buffers are empty between tiles: resolving empties them. Their margins need not be.
  const KeyBuffer buffer{workspace.keys.get(), kTileWidth + 2 * margin, margin};
  if (!entries.empty()) {
    const TileInput input{
        rect, static_cast<float>(camera.near_m), entries, runs.runs.data(), runs.transforms.data(), list.items.data()};
    const TileCounts counts = splat_tile(input, shapes.data(), intensity.data(), buffer);
    workspace.stats.points_projected += counts.projected;
    workspace.stats.points_drawn += counts.drawn;
  }
  const double splatted = monotonic_s();
  resolve_tile(buffer, rect.width, rect.height, shading.background(), colour, depth, static_cast<size_t>(target.width));
  if (!entries.empty() && (rect.width < kTileWidth || rect.height < kTileHeight)) empty_beyond(buffer, rect);
  workspace.stats.project_ms += (splatted - start) * 1e3;
  workspace.stats.resolve_ms += (monotonic_s() - splatted) * 1e3;
}

CpuSplatter::CpuSplatter(int threads) : impl_(std::make_unique<Impl>(threads)) {}
CpuSplatter::~CpuSplatter() = default;

SplatStats CpuSplatter::render(const DrawList& list, const geometry::Camera& camera, const RenderOptions& options,
                               const image::Shading& shading, const FrameTarget& target) {
  CHECK(target.width == camera.width && target.height == camera.height && target.colour);
  Impl& m = *impl_;
  m.prepare(list, camera, options.kernel, shading);
  for (Workspace& w : m.workspaces) {
    // Emptied whole where the margin moves; else every tile leaves its pixels empty.
    const size_t size = static_cast<size_t>(kTileWidth + 2 * m.margin) * (kTileHeight + 2 * m.margin);
    if (w.size != size) {
      w.keys = hwy::AllocateAligned<uint64_t>(size);
      std::fill_n(w.keys.get(), size, static_cast<uint64_t>(kEmptyKey));
      w.size = size;
    }
    w.stats = {};
  }
  m.arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, m.grid.count(), 1),
        [&](const tbb::blocked_range<int>& tiles) {
          Workspace& workspace = m.workspaces[static_cast<size_t>(tbb::this_task_arena::current_thread_index())];
          for (int i = tiles.begin(); i < tiles.end(); ++i) m.draw_tile(i, list, camera, shading, target, workspace);
        },
        tbb::simple_partitioner());
  });
  SplatStats sum;
  for (const Workspace& w : m.workspaces) {
    sum.points_projected += w.stats.points_projected;
    sum.points_drawn += w.stats.points_drawn;
    sum.project_ms += w.stats.project_ms;
    sum.resolve_ms += w.stats.resolve_ms;
  }
  return sum;
}

}  // namespace telesplat::splat
