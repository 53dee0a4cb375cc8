#include <algorithm>
#include <cmath>
#include <memory>

#include "services/sampler/julia/steps.h"
#include "services/sampler/julia/trace.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "services/sampler/julia/kernels.cpp"
#include <hwy/foreach_target.h>  // compiles the rest once for each target

#include <hwy/highway.h>

#include "services/sampler/julia/surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

// Moves the rays that met something to the front, and fills the last vectors with copies of one of them.
void KeepHits(Queue& queue) {
  int kept = 0;
  const auto copy = [&](int from, int to) {
    for (auto& d : queue.d) d[to] = d[from];
    queue.inverse[to] = queue.inverse[from];
    queue.bracket_t0[to] = queue.bracket_t0[from], queue.bracket_g0[to] = queue.bracket_g0[from];
    queue.bracket_t1[to] = queue.bracket_t1[from], queue.bracket_g1[to] = queue.bracket_g1[from];
    queue.x[to] = queue.x[from], queue.y[to] = queue.y[from];
  };
  for (int i = 0; i < queue.count; ++i) {
    if (!queue.met[i]) continue;
    if (kept != i) copy(i, kept);
    ++kept;
  }
  queue.count = kept;
  if (kept > 0)
    for (int i = 0; i < kMarchWays * static_cast<int>(kMaxLanes); ++i) copy(0, kept + i);
}

// Traces the rays of all parts in one queue: lanes that are done find new rays even if parts have few.
void TraceParts(const Constants& k, const JuliaRays& rays, std::span<const JuliaPart> parts, JuliaPoints& out) {
  static_assert(JuliaPoints::kPadded - JuliaPoints::kMost >= kMarchWays * static_cast<int>(kMaxLanes));
  float start[JuliaPart::kBlocks + kMaxLanes];
  thread_local const std::unique_ptr<Queue> queue = std::make_unique<Queue>();
  queue->count = 0;
  for (const JuliaPart& part : parts) {
    MarchCones(k, rays, part, start);
    ClipRays(k, rays, part, start, *queue);
  }
  March(k, rays, *queue);
  KeepHits(*queue);
  Refine(k, rays, *queue);
  Shade(k, rays, *queue, out);
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::sampler {

HWY_EXPORT(TraceParts);

namespace {
float dot3(const float* a, const float* b) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }
}  // namespace

bool face_normal(const JuliaScene::Constants& k, const JuliaRays& rays, const float* direction, float t,
                 float* normal) {
  for (int i = 0; i < 3; ++i) {
    const float v = direction[i], inverse = 1.0f / (std::abs(v) < kParallel ? kParallel : v);
    const float ta = (k.box_lo[i] - rays.origin[4 + i]) * inverse, tb = (k.box_hi[i] - rays.origin[4 + i]) * inverse;
    if (std::min(ta, tb) != t) continue;
    std::fill_n(normal, 3, 0.0f);
    normal[i] = v < 0 ? 1.0f : -1.0f;
    return true;
  }
  for (int i = 0; i < k.planes; ++i) {
    const float v = dot3(k.plane_normal[i], direction), inverse = 1.0f / (std::abs(v) < kParallel ? kParallel : v);
    const float at = (k.plane_offset[i] - dot3(k.plane_normal[i], rays.origin + 4)) * inverse;
    if (inverse < 0 || at != t) continue;
    for (int a = 0; a < 3; ++a) normal[a] = -k.plane_normal[i][a];
    return true;
  }
  return false;
}

void julia_trace(const JuliaScene::Constants& scene, const JuliaRays& rays, std::span<const JuliaPart> parts,
                 JuliaPoints& points) {
  HWY_DYNAMIC_DISPATCH(TraceParts)(scene, rays, parts, points);
}

}  // namespace telesplat::sampler
#endif
