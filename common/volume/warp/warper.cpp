#include "common/volume/warp/warper.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/parallel/in_parallel.h"
#include "common/volume/warp/plan.h"

namespace telesplat::volume {

uint64_t VolumeFrame::pixels() const {
  return std::accumulate(layers.begin(), layers.end(), uint64_t{0}, [](uint64_t sum, const LayerImage& l) {
    return sum + static_cast<uint64_t>(l.rect.width) * static_cast<uint64_t>(l.rect.height);
  });
}

VolumeFrame make_volume_frame(const Grid& grid, const ShearFrame& shear, std::span<const SliceImage> images,
                              FrameId frame, EpochId epoch, uint64_t bytes) {
  return {grid, shear, merge_layers(images, shear), frame, epoch, bytes};
}

std::vector<int> front_to_back(const VolumeFrame& frame, const glm::dvec3& eye_index) {
  const auto distance = [&](int i) {
    const int layer = frame.layers[static_cast<size_t>(i)].layer;
    return std::abs(frame.shear.layers[static_cast<size_t>(layer)].plane - eye_index[frame.shear.axis]);
  };
  std::vector<int> out(frame.layers.size());
  std::iota(out.begin(), out.end(), 0);
  std::erase_if(out, [&](int i) { return !(distance(i) > 1e-9); });
  std::stable_sort(out.begin(), out.end(), [&](int a, int b) { return distance(a) < distance(b); });
  return out;
}

struct Warper::Impl {
  explicit Impl(int threads)
      : arena(threads > 0 ? threads : tbb::task_arena::automatic),
        workspaces(static_cast<size_t>(arena.max_concurrency())) {}

  struct Workspace {
    std::vector<WarpLayer> layers;
    double seconds = 0;
    uint64_t samples = 0;
  };
  tbb::task_arena arena;
  std::vector<Workspace> workspaces;
};

Warper::Warper(int threads) : impl_(std::make_unique<Impl>(threads)) {}
Warper::~Warper() = default;

WarpStats Warper::render(const VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                         const WarpTarget& target) {
  CHECK(target.width == camera.width && target.height == camera.height && target.colour);
  const double start = monotonic_s();
  const VolumeFrame nothing{};
  const WarpPlan plan(frame ? *frame : nothing, camera);
  WarpStats stats;
  stats.images = plan.layers();
  stats.prepare_ms = (monotonic_s() - start) * 1e3;
  for (auto& w : impl_->workspaces) w.seconds = 0, w.samples = 0;

  const auto draw = [&](int index, Impl::Workspace& workspace) {
    const int tx = index % plan.tiles_x(), ty = index / plan.tiles_x();
    WarpTile tile;
    plan.place(tx, ty, tile, workspace.layers);
    const geometry::Rect rect = plan.rect(tx, ty);
    const ptrdiff_t corner = ptrdiff_t{rect.y - tile.y0} * target.width + (rect.x - tile.x0);
    tile.background = background & 0xffffff;
    tile.colour = target.colour + corner;
    tile.depth_m = target.depth_m ? target.depth_m + corner : nullptr;
    tile.pitch = target.width;
    workspace.samples += warp_tile(tile);
  };
  impl_->arena.execute([&] {
    in_parallel(tbb::blocked_range<int>(0, plan.tiles_x() * plan.tiles_y(), 4), [&](const tbb::blocked_range<int>& r) {
      const double begin = monotonic_s();
      auto& workspace = impl_->workspaces[static_cast<size_t>(thread_in_loop())];
      for (int i = r.begin(); i < r.end(); ++i) draw(i, workspace);
      workspace.seconds += monotonic_s() - begin;
    });
  });
  for (const auto& w : impl_->workspaces) {
    stats.warp_cpu_ms += w.seconds * 1e3;
    stats.samples += w.samples;
  }
  stats.warp_ms = (monotonic_s() - start) * 1e3;
  return stats;
}

}  // namespace telesplat::volume
