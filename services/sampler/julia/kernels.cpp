#include <algorithm>
#include <memory>

#include "services/sampler/julia/trace.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "services/sampler/julia/kernels.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

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

// The rays of all parts stand in one queue: lanes that are done find others even where parts have few rays.
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

void julia_trace(const JuliaScene::Constants& scene, const JuliaRays& rays, std::span<const JuliaPart> parts,
                 JuliaPoints& points) {
  HWY_DYNAMIC_DISPATCH(TraceParts)(scene, rays, parts, points);
}

}  // namespace telesplat::sampler
#endif
