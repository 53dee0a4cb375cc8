// Mesh samplers on a terrain of about a million triangles, whole frames of 1280 x 800. Baseline in the same run:
// the OpenGL rasteriser.
#include <benchmark/benchmark.h>

#include <array>

#include "common/geometry/trajectory.h"
#include "services/sampler/mesh/sampler.h"
#include "tests/support/masks.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::sampler {
namespace {

constexpr geometry::Rect kFrame{0, 0, 1280, 800};

// 90 degrees as in a session (the terrain covers a quarter of the frame), 40 degrees for a frame full of it.
geometry::Camera view(double fov_deg) {
  return geometry::make_camera(geometry::Trajectory::orbit().at(3), fov_deg, kFrame.width, kFrame.height);
}

const test::ChunkList& terrain() {
  static const test::ChunkList chunks = test::terrain(724, 181);
  return chunks;
}

void count(benchmark::State& state, double rays) {
  state.counters["Mrays/s"] = benchmark::Counter(rays / 1e6 * double(state.iterations()), benchmark::Counter::kIsRate);
}

void sample_frames(benchmark::State& state, Sampler& sampler) {
  if (!sampler.add_chunks(terrain()).ok()) return state.SkipWithError("chunks refused");
  const geometry::Camera camera = view(double(state.range(0)));
  size_t covered = 0;
  for (auto _ : state) {
    const image::DepthImage image = sampler.sample(camera, kFrame);
    covered = size_t(std::count_if(image.depth.begin(), image.depth.end(), [](uint32_t d) { return d != 0; }));
  }
  state.counters["covered"] = double(covered) / (kFrame.width * kFrame.height);
  count(state, kFrame.width * kFrame.height);
}

void SamplerRay(benchmark::State& state) { sample_frames(state, *make_ray_sampler(0)); }

void SamplerRaster(benchmark::State& state) {
  auto sampler = make_raster_sampler();
  if (!sampler) return state.SkipWithError(sampler.error().text.c_str());
  sample_frames(state, **sampler);
}

void SamplerRenderDirectly(benchmark::State& state) {
  auto sampler = make_ray_sampler(0);
  if (!sampler->add_chunks(terrain()).ok()) return state.SkipWithError("chunks refused");
  geometry::Camera camera = view(double(state.range(0)));
  camera.width = 2560, camera.height = 1600;
  const image::Shading shading({}, camera);
  for (auto _ : state) benchmark::DoNotOptimize(render_directly(*sampler, camera, shading).colour.data());
  count(state, 2560.0 * 1600);
}

// Time from chunks in memory to the first ray.
void SamplerBuild(benchmark::State& state) {
  const geometry::Camera camera = view(90);
  for (auto _ : state) {
    auto sampler = make_ray_sampler(0);
    if (!sampler->add_chunks(terrain()).ok()) return state.SkipWithError("chunks refused");
    benchmark::DoNotOptimize(sampler->sample(camera, {640, 400, 1, 1}).depth[0]);
  }
  state.counters["Mtriangles/s"] =
      benchmark::Counter(2 * 724 * 724 / 1e6 * double(state.iterations()), benchmark::Counter::kIsRate);
}

// Frames in masked tiles of 256 x 200, as plans lease them. Compare us/ray with that of SamplerRay.
enum class Rays { kAll, kHalf, kTenth, kBands, kSpread };
void sample_masked(benchmark::State& state, Sampler& sampler) {
  if (!sampler.add_chunks(terrain()).ok()) return state.SkipWithError("chunks refused");
  const geometry::Camera camera = view(40);
  const auto mask = [&] {
    switch (static_cast<Rays>(state.range(0))) {
      case Rays::kAll:
        return test::full_mask(256, 200);
      case Rays::kHalf:
        return test::random_mask(256, 200, 0.5, 1);
      case Rays::kTenth:
        return test::random_mask(256, 200, 0.1, 1);
      case Rays::kBands:
        return test::band_mask(256, 200, 3);
      default:
        return test::spread_mask(256, 200, 32, 1);
    }
  }();
  state.SetLabel(std::array{"all", "half", "tenth", "bands", "one in 32"}.at(static_cast<size_t>(state.range(0))));
  for (auto _ : state)
    for (int y = 0; y < kFrame.height; y += 200)
      for (int x = 0; x < kFrame.width; x += 256)
        benchmark::DoNotOptimize(sampler.sample(camera, {x, y, 256, 200}, &mask).depth.data());
  const double rays = 20 * double(mask.count());
  count(state, rays);
  state.counters["us/ray"] = benchmark::Counter(rays / 1e6 * double(state.iterations()),
                                                benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void SamplerRayMasked(benchmark::State& state) { sample_masked(state, *make_ray_sampler(1)); }
void SamplerRasterMasked(benchmark::State& state) {
  auto sampler = make_raster_sampler();
  if (!sampler) return state.SkipWithError(sampler.error().text.c_str());
  sample_masked(state, **sampler);
}

BENCHMARK(SamplerRayMasked)->DenseRange(0, 4)->Unit(benchmark::kMillisecond);
BENCHMARK(SamplerRasterMasked)->DenseRange(0, 4)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(SamplerRay)->Arg(90)->Arg(40)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(SamplerRaster)->Arg(90)->Arg(40)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(SamplerRenderDirectly)->Arg(90)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(SamplerBuild)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace telesplat::sampler
