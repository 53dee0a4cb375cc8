// Quaternion Julia sets, frames of 1024 x 640 on one core, seen from the default pose and filling the view, by
// instruction set beside the scalar oracle. The thesis took 69.3 s a frame of this size on one node (table 7.2):
// counter thesis/this.
#include <benchmark/benchmark.h>

#include "common/geometry/trajectory.h"
#include "services/sampler/julia/sampler.h"
#include "tests/support/julia/plain.h"
#include "tests/support/masks.h"
#include "tests/support/simd_targets.h"

namespace telesplat::sampler {
namespace {

constexpr geometry::Rect kFrame{0, 0, 1024, 640};
constexpr double kThesis_s = 69.3;

geometry::Camera from(double distance_m) {
  geometry::Pose pose = geometry::default_pose();
  pose.position_room *= distance_m / glm::length(pose.position_room);
  return geometry::make_camera(pose, 90, kFrame.width, kFrame.height);
}

JuliaScene scene_of(const julia::Preset& preset) {
  return {preset.parameters, julia::place(julia::bounds(preset.parameters), 0.8)};
}

// target: 0 is the scalar oracle. rows: rows of a lease; the frame is sampled lease after lease.
void frame(benchmark::State& state, const julia::Preset& preset, double distance_m, int64_t target, int rows) {
  const testing::OnTarget on(target == 0 ? testing::simd_targets().front() : target);
  JuliaSampler sampler(1, target == 0 ? julia_trace_plainly : julia_trace);
  const JuliaScene scene = scene_of(preset);
  const geometry::Camera camera = from(distance_m);
  size_t covered = 0;
  for (auto _ : state) {
    covered = 0;
    for (int y = 0; y < kFrame.height; y += rows) {
      const image::DepthImage image = sampler.sample(scene, camera, {0, y, kFrame.width, rows}, 1);
      covered +=
          static_cast<size_t>(std::count_if(image.depth.begin(), image.depth.end(), [](uint32_t d) { return d != 0; }));
    }
  }
  const double rays = double(kFrame.width) * kFrame.height, frames = double(state.iterations());
  state.counters["covered"] = double(covered) / rays;
  state.counters["Mrays/s"] = benchmark::Counter(rays / 1e6 * frames, benchmark::Counter::kIsRate);
  state.counters["thesis/this"] = benchmark::Counter(kThesis_s * frames, benchmark::Counter::kIsRate);
}

// Masked tiles of 128 x 128, as plans lease them; compare us/ray with that of all rays.
void masked(benchmark::State& state, double share) {
  JuliaSampler sampler(1);
  const JuliaScene scene = scene_of(julia::presets()[0]);
  const geometry::Camera camera = from(0.7377);
  const image::PixelMask mask = test::random_mask(128, 128, share, 1);
  for (auto _ : state)
    for (int y = 0; y < kFrame.height; y += 128)
      for (int x = 0; x < kFrame.width; x += 128)
        benchmark::DoNotOptimize(sampler.sample(scene, camera, {x, y, 128, 128}, 1, &mask).depth.data());
  const double rays = double(mask.count()) * 40 * double(state.iterations());
  state.counters["us/ray"] = benchmark::Counter(rays / 1e6, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Takes a preset's number: while benchmarks register themselves, presets are not initialised yet.
void add(int preset, double distance_m, int64_t target, int rows, const std::string& what) {
  const std::string name = "JuliaFrame/preset:" + std::to_string(preset) + "/" + what;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    state.SetLabel(std::string(julia::presets()[static_cast<size_t>(preset)].name));
    frame(state, julia::presets()[static_cast<size_t>(preset)], distance_m, target, rows);
  })->Unit(benchmark::kMillisecond);
}

// Every preset at 1 m; the default one also nearer, by target, and in leases of few rows.
const bool registered = [] {
  const int64_t best = testing::simd_targets().front();
  for (const auto& [distance_m, name] : {std::pair{1.0, "1m/"}, {0.7377, "default/"}, {0.45, "0.45m/"}}) {
    add(0, distance_m, 0, kFrame.height, std::string(name) + "scalar");
    for (const int64_t target : testing::simd_targets())
      add(0, distance_m, target, kFrame.height, std::string(name) + hwy::TargetName(target));
  }
  for (const double share : {1.0, 0.5, 0.1, 1.0 / 32, 0.01})
    benchmark::RegisterBenchmark(("JuliaMasked/" + std::to_string(share)).c_str(), [=](benchmark::State& state) {
      masked(state, share);
    })->Unit(benchmark::kMillisecond);
  for (const int rows : {1, 4, 16})
    add(0, 1, best, rows, "1m/" + std::string(hwy::TargetName(best)) + "/rows:" + std::to_string(rows));
  for (int preset = 1; preset < static_cast<int>(julia::presets().size()); ++preset) {
    add(preset, 1, 0, kFrame.height, "1m/scalar");
    add(preset, 1, best, kFrame.height, std::string("1m/") + hwy::TargetName(best));
  }
  return true;
}();

}  // namespace
}  // namespace telesplat::sampler
