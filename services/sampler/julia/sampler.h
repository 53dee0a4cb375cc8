// Samples a quaternion Julia set: rays of a camera in, depth images out (T4.2.2). No sockets, no clocks.
#pragma once

#include <tbb/task_arena.h>

#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/file.h"
#include "common/image/shading.h"
#include "services/sampler/julia/scene.h"
#include "services/sampler/julia/trace.h"

namespace telesplat::sampler {

class JuliaSampler {
 public:
  /// threads: how many oneTBB threads trace, 0 = all cores. trace: for tests and benchmarks.
  explicit JuliaSampler(int threads, JuliaTrace trace = julia_trace);

  /// Samples the pixels `rect` of the frame `camera` at their centres: the first point of a ray, inside the box and
  /// beyond the near plane, whose distance estimate is lod footprints or less. step: the footprint is that of a pixel
  /// of camera / step (4 for a camera that takes every fourth pixel of every fourth row), at least 1. Colours are unlit
  /// albedo, darkened by occlusion and shadow; normals face the camera. Returns a canonical image of rect.width x
  /// rect.height. A pixel does not depend on the rectangle it was asked for with. Precondition: rect lies in the
  /// camera's image. Any number of threads may call it.
  image::DepthImage sample(const JuliaScene& scene, const geometry::Camera& camera, const geometry::Rect& rect,
                           int step);

 private:
  tbb::task_arena arena_;
  JuliaTrace trace_;
};

/// Direct rendering for verification: every pixel of `camera` traced, shaded with unquantised normals. Depth in metres,
/// +infinity where nothing is. threads: 0 = all cores.
image::View render_julia_directly(const JuliaScene& scene, const geometry::Camera& camera,
                                  const image::Shading& shading, int threads);

}  // namespace telesplat::sampler
