// splat/*: one million points on a display of 2560x1600, beside what clearing such a frame's memory costs on this machine.
// The points are those of one 1280x800 depth image of a wavy surface, seen from where it was sampled. Times are wall-clock; core_ms
// is what all threads together spent.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstring>
#include <ctime>

#include "client/viewer/render/renderer.h"
#include "common/geometry/trajectory.h"
#include "common/image/normal.h"
#include "common/splat/cpu_splatter.h"
#include "common/splat/reference_depth.h"
#include "common/splat/view_selection.h"

namespace telesplat {
namespace {

constexpr int kDisplayWidth = 2560, kDisplayHeight = 1600;

double process_cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

geometry::Camera sampling_camera() { return geometry::make_camera(geometry::default_pose(), 90, 1280, 800); }
geometry::Camera display_camera() {
  return geometry::make_camera(geometry::default_pose(), 90, kDisplayWidth, kDisplayHeight);
}

// A wavy surface across the whole view; `pixels` keeps every pixel of a phase out of 64, or all of them.
image::DepthImage wavy_image(const geometry::Camera& camera, int phase = -1) {
  image::DepthImage out(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (phase >= 0 && (x / 3 + 5 * (y / 3)) % 64 != phase) continue;
      const double u = x / double(camera.width), v = y / double(camera.height);
      const double depth = 0.7 + 0.06 * std::sin(21 * u) * std::cos(17 * v) + 0.004 * std::sin(190 * u + 130 * v);
      const size_t i = static_cast<size_t>(y) * camera.width + x;
      out.depth[i] = image::encode_depth(depth, camera.near_m);
      out.colour[i] = static_cast<uint32_t>(x * 7 ^ y * 13) & 0xffffff;
      out.normal[i] = image::encode_normal16({0.4f * std::cos(21 * float(u)), 0.3f * std::sin(17 * float(v)), 1});
    }
  return out;
}

points::ModelConfig model_config() { return {{{-1.0f, -1.0f, -1.0f}, {1.0f, 1.0f, 1.0f}}, 7}; }

// patches = 1: one mosaic a cluster. 64: the same points in mosaics of a few points each, as after many small updates.
const points::PointModel& model(int patches) {
  static points::PointModel one(model_config()), many(model_config());
  points::PointModel& m = patches == 1 ? one : many;
  if (m.points() == 0) {
    const geometry::Camera camera = sampling_camera();
    for (int i = 0; i < patches; ++i)
      m.insert(points::prepare_patch(m.config(), Sequence{static_cast<uint64_t>(i) + 1}, camera,
                                     {0, 0, camera.width, camera.height}, wavy_image(camera, patches == 1 ? -1 : i)));
  }
  return m;
}

splat::DrawList draw_list(int patches, float splat_px) {
  splat::DrawList list;
  splat::select_view(model(patches), display_camera(), {}, list);
  for (splat::DrawItem& item : list.items) item.splat_px = splat_px;
  return list;
}

void splat_points(benchmark::State& state, splat::Kernel kernel, int patches) {
  const geometry::Camera camera = display_camera();
  const image::Shading shading({}, camera);
  const splat::DrawList list = draw_list(patches, static_cast<float>(state.range(0)));
  const int threads = static_cast<int>(state.range(1));
  const bool with_depth = state.range(2) != 0;
  splat::CpuSplatter splatter(threads);
  std::vector<uint32_t> colour(size_t{kDisplayWidth} * kDisplayHeight);
  std::vector<float> depth(with_depth ? colour.size() : 0);
  const splat::FrameTarget target{kDisplayWidth, kDisplayHeight, colour.data(), with_depth ? depth.data() : nullptr};
  splat::SplatStats stats = splatter.render(list, camera, kernel, shading, target);
  double splat_ms = 0, resolve_ms = 0;
  const double cpu_ms = process_cpu_ms();
  for (auto _ : state) {
    stats = splatter.render(list, camera, kernel, shading, target);
    splat_ms += stats.project_ms, resolve_ms += stats.resolve_ms;
  }
  const auto frames = static_cast<double>(state.iterations());
  state.counters["core_ms"] = (process_cpu_ms() - cpu_ms) / frames;
  state.counters["splat_ms"] = splat_ms / frames;
  state.counters["resolve_ms"] = resolve_ms / frames;
  state.counters["points"] = static_cast<double>(list.points);
  state.counters["tested_again"] = static_cast<double>(stats.points_projected) / static_cast<double>(list.points) - 1;
  state.SetItemsProcessed(static_cast<int64_t>(list.points) * state.iterations());
}
void splat_square(benchmark::State& state) { splat_points(state, splat::Kernel::kSquare, 1); }
void splat_disc(benchmark::State& state) { splat_points(state, splat::Kernel::kDisc, 1); }
void splat_square_64_patches(benchmark::State& state) { splat_points(state, splat::Kernel::kSquare, 64); }

#define SPLAT_ARGS ->ArgNames({"px", "threads", "depth"})->UseRealTime()->Unit(benchmark::kMillisecond)
BENCHMARK(splat_square)
SPLAT_ARGS->Args({1, 1, 0})->Args({2, 1, 0})->Args({3, 1, 0})->Args({5, 1, 0})->Args({3, 2, 0})->Args({3, 2, 1});
BENCHMARK(splat_disc) SPLAT_ARGS->Args({3, 1, 0})->Args({5, 1, 0})->Args({3, 2, 0});
BENCHMARK(splat_square_64_patches) SPLAT_ARGS->Args({3, 1, 0})->Args({3, 2, 0});

void splat_select_view(benchmark::State& state) {
  const points::PointModel& m = model(static_cast<int>(state.range(0)));
  splat::DrawList list;
  for (auto _ : state) splat::select_view(m, display_camera(), {}, list);
  state.counters["clusters"] = static_cast<double>(list.clusters_seen.size());
  state.counters["mosaics"] = static_cast<double>(list.items.size());
}
BENCHMARK(splat_select_view)->ArgName("patches")->Arg(1)->Arg(64)->Unit(benchmark::kMillisecond);

void splat_reference_depth(benchmark::State& state) {
  const points::PointModel& m = model(static_cast<int>(state.range(1)));
  std::vector<float> depth;
  for (auto _ : state) splat::render_reference_depth(m, sampling_camera(), static_cast<int>(state.range(0)), depth);
  state.SetItemsProcessed(static_cast<int64_t>(m.points()) * state.iterations());
}
BENCHMARK(splat_reference_depth)
    ->ArgNames({"threads", "patches"})
    ->Args({1, 1})
    ->Args({2, 1})
    ->Args({1, 64})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void splat_eliminate_redundancy(benchmark::State& state) {
  const geometry::Camera camera = sampling_camera();
  const image::DepthImage original = wavy_image(camera);
  std::vector<float> depth;
  splat::render_reference_depth(model(1), camera, 1, depth);
  image::DepthImage image = original;
  for (auto _ : state) {
    state.PauseTiming();
    image = original;
    state.ResumeTiming();
    benchmark::DoNotOptimize(
        splat::eliminate_redundancy(camera, {0, 0, camera.width, camera.height}, depth, 0.002f, image));
  }
  state.SetItemsProcessed(static_cast<int64_t>(image.pixels()) * state.iterations());
}
BENCHMARK(splat_eliminate_redundancy)->Unit(benchmark::kMillisecond);

// Baseline: the same frames as GL_POINTS (on a machine without GPU: Mesa's llvmpipe on all cores), read back included.
void splat_baseline_gl_points(benchmark::State& state) {
  auto gl = viewer::make_gl_renderer();
  if (!gl) return state.SkipWithError(gl.error().text.c_str());
  const geometry::Camera camera = display_camera();
  const image::Shading shading({}, camera);
  const splat::DrawList list = draw_list(1, static_cast<float>(state.range(0)));
  std::vector<uint32_t> colour(size_t{kDisplayWidth} * kDisplayHeight);
  const splat::FrameTarget target{kDisplayWidth, kDisplayHeight, colour.data(), nullptr};
  (*gl)->render(list, camera, splat::Kernel::kSquare, shading, target);  // uploads
  for (auto _ : state) (*gl)->render(list, camera, splat::Kernel::kSquare, shading, target);
  state.SetItemsProcessed(static_cast<int64_t>(list.points) * state.iterations());
}
BENCHMARK(splat_baseline_gl_points)
    ->ArgName("px")
    ->Arg(1)
    ->Arg(3)
    ->Arg(5)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// Baseline: what merely clearing a frame of 64-bit keys in memory and writing its colours costs.
void splat_baseline_memset(benchmark::State& state) {
  std::vector<uint64_t> frame(size_t{kDisplayWidth} * kDisplayHeight * 3 / 2);
  for (auto _ : state) {
    std::memset(frame.data(), 0xff, frame.size() * 8);
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<int64_t>(frame.size()) * 8 * state.iterations());
}
BENCHMARK(splat_baseline_memset)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
