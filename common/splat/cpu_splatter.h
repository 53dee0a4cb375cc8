// The CPU splatter: Highway SIMD, run-time dispatch, one screen tile a task, no lock in the hot path.
#pragma once

#include <array>
#include <memory>

#include "common/image/shading.h"
#include "common/splat/render_options.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::splat {

/// Images that a frame is drawn into. colour: width * height of 0x00RRGGBB (alpha byte 0xff), row-major; depth_m: the
/// same shape, or null.
struct FrameTarget {
  int width = 0, height = 0;
  uint32_t* colour = nullptr;
  float* depth_m = nullptr;  ///< metres along the view axis; +infinity for empty pixels
  size_t pitch = 0;          ///< pixels from a row to the next one, of both; 0: width
  size_t row() const { return pitch > 0 ? pitch : static_cast<size_t>(width); }
};

struct SplatStats {
  uint64_t points_projected = 0, points_drawn = 0;
  double prepare_ms = 0;                                ///< wall-clock time before the first tile
  double project_ms = 0, resolve_ms = 0;                ///< splatting and shading, summed over threads
  double fill_ms = 0, smooth_ms = 0, antialias_ms = 0;  ///< the finish, summed over threads

  SplatStats& operator+=(const SplatStats& other);
};

class CpuSplatter {
 public:
  /// threads: 0 = usable_processors().
  explicit CpuSplatter(int threads = 0);
  ~CpuSplatter();

  /// Clears, splats, resolves and finishes one frame, tile by tile: splat -> resolve -> the stages of options.finish
  /// (finish.h) -> write. Pixels are shaded with shading.table(). camera.width/height are target's. options.halved:
  /// interpolates colours between drawn pixels (finish.h); depths are the nearest pixel's.
  SplatStats render(const DrawList& list, const geometry::Camera& camera, const RenderOptions& options,
                    const image::Shading& shading, const FrameTarget& target);
  /// Draws two views of one list: prepares their common data once, and shares all threads between them. Each image is
  /// the same as from render(). Preconditions: the cameras have one size and one near distance, and about one focal
  /// length (both use the flat splats of the first); shading fits both.
  SplatStats render_pair(const DrawList& list, const std::array<geometry::Camera, 2>& cameras,
                         const RenderOptions& options, const image::Shading& shading,
                         const std::array<FrameTarget, 2>& targets);
  /// Draws without any finish.
  SplatStats render(const DrawList& list, const geometry::Camera& camera, Kernel kernel, const image::Shading& shading,
                    const FrameTarget& target) {
    return render(list, camera, {kernel, {false, false, false}}, shading, target);
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::splat
