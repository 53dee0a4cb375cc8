// splat/*: one million points on a display of 2560x1600, beside GL_POINTS and the machine's memory bandwidth, in the
// same run. The points are those of one 1280x800 depth image of a wavy surface, seen from where it was sampled. Times
// are wall-clock; core_ms is the sum over all threads. bytes_floor: bytes that must cross the memory bus for a frame,
// each point read once (12 bytes) and each pixel written once; floor_ms: the time for them at the bandwidth measured
// here on two threads; times_floor: the frame's time over floor_ms. times_gl_points: time of GL_POINTS of that size
// over the frame's.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstring>
#include <ctime>
#include <map>
#include <thread>

#include "client/viewer/render/renderer.h"
#include "common/core/clock.h"
#include "common/geometry/stereo.h"
#include "common/geometry/trajectory.h"
#include "common/image/normal.h"
#include "common/splat/cpu_splatter.h"
#include "common/splat/reference/reference_depth.h"
#include "common/splat/select/view_selection.h"
#include "tests/support/eye_cameras.h"

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
  for (splat::DrawItem& item : list.items) {
    item.radius_m *= splat_px / item.splat_px;
    item.splat_px = splat_px;
  }
  return list;
}

// Every point of one depth image of about `millions` million pixels, each a pixel large.
splat::DrawList many_points(int millions) {
  static std::map<int, points::PointModel> models;
  const int width = millions == 4 ? 2560 : 3584, height = width * 5 / 8;
  points::PointModel& m = models.try_emplace(millions, model_config()).first->second;
  if (m.points() == 0) {
    const geometry::Camera camera = geometry::make_camera(geometry::default_pose(), 90, width, height);
    m.insert(points::prepare_patch(m.config(), Sequence{1}, camera, {0, 0, width, height}, wavy_image(camera)));
  }
  splat::DrawList list;
  for (const auto& [key, cluster] : m.clusters())
    for (const points::Mosaic& mosaic : cluster->mosaics) {
      list.items.push_back({cluster.get(), mosaic.level(0), 1.0f});
      list.points += list.items.back().level.count;
    }
  return list;
}

// Bytes a second that two threads read and write, the best of several passes over 128 MiB (after McCalpin's STREAM).
struct Bandwidth {
  double read = 0, write = 0, copy = 0;
};
const Bandwidth& memory_bandwidth() {
  static const Bandwidth measured = [] {
    constexpr size_t kWords = size_t{8} << 20;  // words of 8 bytes a thread
    constexpr int kThreads = 2;
    std::vector<uint64_t> from(kThreads * kWords, 1), to(kThreads * kWords, 2);
    const auto best = [&](double bytes, const auto& pass) {
      double rate = 0;
      for (int i = 0; i < 6; ++i) {
        const double start = monotonic_s();
        std::vector<std::thread> threads;
        for (size_t t = 0; t < kThreads; ++t)
          threads.emplace_back([&, t] { pass(&from[t * kWords], &to[t * kWords]); });
        for (std::thread& t : threads) t.join();
        rate = std::max(rate, bytes / (monotonic_s() - start));
      }
      return rate;
    };
    constexpr double kBytes = 8.0 * kThreads * kWords;
    Bandwidth b;
    b.read = best(kBytes, [&](const uint64_t* f, uint64_t*) {
      uint64_t sums[8] = {};
      for (size_t i = 0; i < kWords; i += 8)
        for (size_t j = 0; j < 8; ++j) sums[j] ^= f[i + j];
      benchmark::DoNotOptimize(sums);
    });
    b.write =
        best(kBytes, [&](const uint64_t*, uint64_t* t) { std::memset(t, 1, kWords * 8), benchmark::ClobberMemory(); });
    b.copy = best(2 * kBytes,
                  [&](const uint64_t* f, uint64_t* t) { std::memcpy(t, f, kWords * 8), benchmark::ClobberMemory(); });
    return b;
  }();
  return measured;
}

// Milliseconds of a frame of draw_list(1, splat_px) as GL_POINTS, reading back included; 0 without OpenGL.
double gl_points_ms(float splat_px) {
  static std::map<float, double> known;
  const auto [at, fresh] = known.try_emplace(splat_px, 0.0);
  if (!fresh) return at->second;
  auto gl = viewer::make_renderer("gl", 1);
  if (!gl) return 0;
  const geometry::Camera camera = display_camera();
  const image::Shading shading({}, camera);
  const splat::DrawList list = draw_list(1, splat_px);
  std::vector<uint32_t> colour(size_t{kDisplayWidth} * kDisplayHeight);
  const splat::FrameTarget target{kDisplayWidth, kDisplayHeight, colour.data(), nullptr};
  (*gl)->render(list, camera, splat::Kernel::kSquare, shading, target);  // uploads
  const double start = monotonic_s();
  for (int i = 0; i < 3; ++i) (*gl)->render(list, camera, splat::Kernel::kSquare, shading, target);
  return at->second = (monotonic_s() - start) / 3 * 1e3;
}

void splat_points(benchmark::State& state, splat::Kernel kernel, const splat::DrawList& list, int threads,
                  bool with_depth) {
  const geometry::Camera camera = display_camera();
  const image::Shading shading({}, camera);
  splat::CpuSplatter splatter(threads);
  std::vector<uint32_t> colour(size_t{kDisplayWidth} * kDisplayHeight);
  std::vector<float> depth(with_depth ? colour.size() : 0);
  const splat::FrameTarget target{kDisplayWidth, kDisplayHeight, colour.data(), with_depth ? depth.data() : nullptr};
  splat::SplatStats stats = splatter.render(list, camera, kernel, shading, target);
  double splat_ms = 0, resolve_ms = 0;
  const double cpu_ms = process_cpu_ms(), start = monotonic_s();
  for (auto _ : state) {
    stats = splatter.render(list, camera, kernel, shading, target);
    splat_ms += stats.project_ms, resolve_ms += stats.resolve_ms;
  }
  const auto frames = static_cast<double>(state.iterations());
  const double ms = (monotonic_s() - start) * 1e3 / frames, points = static_cast<double>(list.points);
  state.counters["core_ms"] = (process_cpu_ms() - cpu_ms) / frames;
  state.counters["splat_ms"] = splat_ms / frames;
  state.counters["resolve_ms"] = resolve_ms / frames;
  state.counters["points"] = points;
  state.counters["tested_again"] = static_cast<double>(stats.points_projected) / points - 1;
  const double read = 12 * points, written = static_cast<double>(4 * (colour.size() + depth.size()));
  const double floor_ms = (read / memory_bandwidth().read + written / memory_bandwidth().write) * 1e3;
  state.counters["bytes_floor"] = read + written;
  state.counters["floor_ms"] = floor_ms;
  state.counters["times_floor"] = ms / floor_ms;
  state.counters["fps"] = 1e3 / ms;
  state.SetItemsProcessed(static_cast<int64_t>(list.points) * state.iterations());
}

void splat_million(benchmark::State& state, splat::Kernel kernel, int patches) {
  const auto px = static_cast<float>(state.range(0));
  const double gl_ms = gl_points_ms(px);
  splat_points(state, kernel, draw_list(patches, px), static_cast<int>(state.range(1)), state.range(2) != 0);
  state.counters["times_gl_points"] = gl_ms * state.counters["fps"] / 1e3;
}
void splat_square(benchmark::State& state) { splat_million(state, splat::Kernel::kSquare, 1); }
void splat_disc(benchmark::State& state) { splat_million(state, splat::Kernel::kDisc, 1); }
void splat_ellipse(benchmark::State& state) { splat_million(state, splat::Kernel::kEllipse, 1); }
void splat_ewa(benchmark::State& state) { splat_million(state, splat::Kernel::kEwa, 1); }
void splat_square_64_patches(benchmark::State& state) { splat_million(state, splat::Kernel::kSquare, 64); }
// Points of one pixel drawn in a second: many in view, so that the frame's own cost does not hide the rate.
void splat_pixels_rate(benchmark::State& state) {
  splat_points(state, splat::Kernel::kSquare, many_points(static_cast<int>(state.range(0))), 2, false);
}

#define SPLAT_ARGS ->ArgNames({"px", "threads", "depth"})->UseRealTime()->Unit(benchmark::kMillisecond)
BENCHMARK(splat_square)
SPLAT_ARGS->Args({1, 1, 0})->Args({2, 1, 0})->Args({3, 1, 0})->Args({5, 1, 0})->Args({3, 2, 0})->Args({3, 2, 1});
BENCHMARK(splat_disc) SPLAT_ARGS->Args({3, 1, 0})->Args({5, 1, 0})->Args({3, 2, 0});
BENCHMARK(splat_ellipse) SPLAT_ARGS->Args({3, 1, 0})->Args({3, 2, 0})->Args({1, 2, 0});
BENCHMARK(splat_ewa) SPLAT_ARGS->Args({3, 1, 0})->Args({3, 2, 0})->Args({1, 2, 0});
BENCHMARK(splat_pixels_rate)->ArgName("Mpoints")->Arg(4)->Arg(8)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(splat_square_64_patches) SPLAT_ARGS->Args({3, 1, 0})->Args({3, 2, 0});

void splat_select_view(benchmark::State& state) {
  const points::PointModel& m = model(static_cast<int>(state.range(0)));
  splat::DrawList list;
  for (auto _ : state) splat::select_view(m, display_camera(), {}, list);
  state.counters["clusters"] = static_cast<double>(list.clusters_seen.size());
  state.counters["mosaics"] = static_cast<double>(list.items.size());
}
BENCHMARK(splat_select_view)->ArgName("patches")->Arg(1)->Arg(64)->Unit(benchmark::kMillisecond);

// Redundant patches, six a cluster: views of 1280x800 that move a little, in blocks of 64 rows, interleaved two by two;
// every third is coarse (every 4th pixel of every 4th row). best: 1 = the best of each cluster are drawn, 0 = all of
// them (the baseline).
void splat_select_best(benchmark::State& state) {
  static points::PointModel m(model_config());
  if (m.points() == 0) {
    uint64_t sequence = 0;
    const auto add_block = [&](uint64_t frame, int block) {
      geometry::Pose pose = geometry::default_pose();
      pose.position_room.x += 0.001 * static_cast<double>(frame);
      const geometry::Camera whole = geometry::make_camera(pose, 90, 1280, 800);
      const geometry::Camera camera = geometry::subsample(whole, frame % 3 == 0 ? 4 : 1);
      if (block * 64 >= camera.height) return;
      const geometry::Rect rect{0, block * 64, camera.width, std::min(64, camera.height - block * 64)};
      const image::DepthImage image = wavy_image(camera);
      image::DepthImage cut(rect.width, rect.height);
      const auto first = static_cast<ptrdiff_t>(rect.y) * rect.width;
      std::copy_n(image.depth.begin() + first, cut.pixels(), cut.depth.begin());
      std::copy_n(image.colour.begin() + first, cut.pixels(), cut.colour.begin());
      std::copy_n(image.normal.begin() + first, cut.pixels(), cut.normal.begin());
      m.insert(points::prepare_patch(m.config(), Sequence{++sequence}, camera, rect, cut, FrameId{frame}));
    };
    for (uint64_t frame = 1; frame <= 6; frame += 2)
      for (int block = 0; block < 13; ++block) add_block(frame, block), add_block(frame + 1, block);
  }
  splat::SelectionOptions options;
  options.best_patch_only = state.range(0) != 0;
  splat::DrawList list;
  for (auto _ : state) splat::select_view(m, display_camera(), options, list);
  size_t mosaics = 0;
  for (const auto& [key, cluster] : m.clusters()) mosaics += cluster->mosaics.size();
  state.counters["clusters"] = static_cast<double>(m.clusters().size());
  state.counters["mosaics"] = static_cast<double>(mosaics);
  state.counters["seen"] = static_cast<double>(list.clusters_seen.size());
  state.counters["points"] = static_cast<double>(list.points);
}
BENCHMARK(splat_select_best)->ArgName("best")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// A frame as the display makes it, finish included, for one eye or for both: one selection serves both eyes.
void splat_eyes(benchmark::State& state) {
  const auto kernel = static_cast<splat::Kernel>(state.range(0));
  const auto eyes = static_cast<size_t>(state.range(1));
  constexpr double kEyeDistance_m = 0.064, kScreen_m = 0.75;
  const geometry::Camera head = display_camera();
  const auto both = geometry::eye_cameras(head, kEyeDistance_m, kScreen_m);
  const points::PointModel& m = model(1);
  splat::CpuSplatter splatter(2);
  std::vector<uint32_t> colour(size_t{2} * kDisplayWidth * kDisplayHeight);
  splat::DrawList list;
  splat::SelectionOptions options;
  options.scale = splat::suitable_scale(kernel);
  if (eyes == 2) options.eyes = both;
  const splat::FrameTarget one{kDisplayWidth, kDisplayHeight, colour.data(), nullptr};
  const std::array<splat::FrameTarget, 2> beside{
      splat::FrameTarget{kDisplayWidth, kDisplayHeight, colour.data(), nullptr, 2 * kDisplayWidth},
      {kDisplayWidth, kDisplayHeight, colour.data() + kDisplayWidth, nullptr, 2 * kDisplayWidth}};
  for (auto _ : state) {
    splat::select_view(m, head, options, list);
    const image::Shading shading({}, head);
    if (eyes == 2)
      splatter.render_pair(list, both, splat::RenderOptions{kernel, {}}, shading, beside);
    else
      splatter.render(list, head, splat::RenderOptions{kernel, {}}, shading, one);
  }
  state.counters["points"] = static_cast<double>(list.points);
  state.counters["fps"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(splat_eyes)
    ->ArgNames({"kernel", "eyes"})
    ->Args({1, 1})
    ->Args({1, 2})
    ->Args({2, 1})
    ->Args({2, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

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

// Baseline: the same frames as GL_POINTS (without GPU: Mesa's llvmpipe on all cores), reading back included.
void splat_baseline_gl_points(benchmark::State& state) {
  auto gl = viewer::make_renderer("gl", 1);
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

// Baseline: bytes a second that two threads move.
void splat_baseline_memory(benchmark::State& state) {
  const Bandwidth& b = memory_bandwidth();
  for (auto _ : state) benchmark::DoNotOptimize(&b);
  state.counters["read_GB_s"] = b.read * 1e-9;
  state.counters["write_GB_s"] = b.write * 1e-9;
  state.counters["copy_GB_s"] = b.copy * 1e-9;
}
BENCHMARK(splat_baseline_memory);

}  // namespace
}  // namespace telesplat
