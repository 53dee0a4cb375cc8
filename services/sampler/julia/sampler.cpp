#include "services/sampler/julia/sampler.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "common/image/normal.h"
#include "services/sampler/julia/palette.h"

namespace telesplat::sampler {

namespace {

// Calls consume(rays, points) for every part of the rectangle, on several threads at once.
template <class Consume>
void trace_rect(tbb::task_arena& arena, JuliaTrace trace, const JuliaScene& scene, const geometry::Camera& camera,
                const geometry::Rect& rect, int step, const Consume& consume) {
  if (rect.width <= 0 || rect.height <= 0) return;
  const JuliaRays rays(scene, camera, rect, step);
  const int dx = rect.x - rays.x0, dy = rect.y - rays.y0;
  // A row of blocks is one task or several, so that even a single row of pixels keeps all threads busy.
  constexpr int kPartBlocks = JuliaPart::kBlocks;
  const int parts = (rays.columns_of_blocks + kPartBlocks - 1) / kPartBlocks;
  const auto trace_part = [&](int block_row, int part, JuliaPoints& points) {
    JuliaPart p;
    p.block_row = block_row;
    p.block_begin = part * kPartBlocks;
    p.block_end = std::min(p.block_begin + kPartBlocks, rays.columns_of_blocks);
    p.x_begin = std::max(p.block_begin * kJuliaBlock, dx);
    p.x_end = std::min(p.block_end * kJuliaBlock, dx + rect.width);
    p.y_begin = std::max(block_row * kJuliaBlock, dy);
    p.y_end = std::min((block_row + 1) * kJuliaBlock, dy + rect.height);
    points.count = 0;
    trace(scene.constants(), rays, p, points);
    consume(rays, points);
  };
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range2d<int>(0, rays.rows_of_blocks, 1, 0, parts, 1),
                      [&](const tbb::blocked_range2d<int>& range) {
                        const auto points = std::make_unique_for_overwrite<JuliaPoints>();
                        for (int row = range.rows().begin(); row < range.rows().end(); ++row)
                          for (int part = range.cols().begin(); part < range.cols().end(); ++part)
                            trace_part(row, part, *points);
                      });
  });
}

}  // namespace

JuliaSampler::JuliaSampler(int threads, JuliaTrace trace)
    : arena_(threads > 0 ? threads : tbb::task_arena::automatic), trace_(trace) {}

image::DepthImage JuliaSampler::sample(const JuliaScene& scene, const geometry::Camera& camera,
                                       const geometry::Rect& rect, int step) {
  image::DepthImage out(rect.width, rect.height);
  const JuliaPalette& palette = julia_palette(scene.palette());
  trace_rect(arena_, trace_, scene, camera, rect, step, [&](const JuliaRays& rays, const JuliaPoints& points) {
    for (int i = 0; i < points.count; ++i) {
      const size_t at = size_t(points.y[i] + rays.y0 - rect.y) * rect.width + (points.x[i] + rays.x0 - rect.x);
      out.depth[at] = image::encode_depth(points.depth_m[i], camera.near_m);
      out.colour[at] = palette.rounded(points.tone[i], points.light[i]);
      out.normal[at] = image::encode_normal16({points.normal[0][i], points.normal[1][i], points.normal[2][i]});
    }
  });
  return out;
}

image::View render_julia_directly(const JuliaScene& scene, const geometry::Camera& camera,
                                  const image::Shading& shading, int threads) {
  const size_t pixels = size_t(camera.width) * camera.height;
  image::View view{camera.width, camera.height, std::vector<uint32_t>(pixels, shading.background()),
                   std::vector<float>(pixels, std::numeric_limits<float>::infinity())};
  const JuliaPalette& palette = julia_palette(scene.palette());
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  trace_rect(
      arena, julia_trace, scene, camera, {0, 0, camera.width, camera.height}, 1,
      [&](const JuliaRays& rays, const JuliaPoints& points) {
        for (int i = 0; i < points.count; ++i) {
          const size_t at = size_t(points.y[i] + rays.y0) * camera.width + (points.x[i] + rays.x0);
          const float intensity = shading.intensity({points.normal[0][i], points.normal[1][i], points.normal[2][i]});
          view.colour[at] = palette.rounded(points.tone[i], points.light[i] * intensity);
          view.depth_m[at] = points.depth_m[i];
        }
      });
  return view;
}

}  // namespace telesplat::sampler
