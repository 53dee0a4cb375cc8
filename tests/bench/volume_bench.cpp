// Volumes on one core: splats a second by pixels a voxel, beside a plain scatter of the same voxels and the time of
// only reading them; frames of 256^3 with about a million visible voxels at 1600 x 1200; rays of the reference.
#include <benchmark/benchmark.h>

#include <cstring>
#include <map>

#include "services/sampler/volume/raycaster.h"
#include "services/sampler/volume/shear/rows.h"
#include "services/sampler/volume/shear/splatter.h"
#include "tests/support/volume/scenes.h"

namespace telesplat::sampler {
namespace {

// Crusts of blobs: runs of voxels as scanned data have them. side 256: about a million.
const test::VolumeScene& crusts(int side) {
  static std::map<int, test::VolumeScene> made;
  if (const auto it = made.find(side); it != made.end()) return it->second;
  const auto value = [](glm::dvec3 p) {
    const double b = test::blobs(p) + 0.02 * std::sin(31 * p.x) * std::sin(29 * p.y) * std::sin(37 * p.z);
    return b > 0.185 && b < 0.5 ? b : 0.0;
  };
  return made[side] = test::make_scene(test::make_grid({side, side, side}, 0.5), value, test::ramp(0.1));
}

geometry::Camera camera(int width, int height) {
  return geometry::make_camera(geometry::look_at({0.15, 0.2, 0.65}, {0, 0, 0}), 60, width, height);
}

// Adds every voxel to the four pixels about it, slice by slice, one after the other: the baseline of the kernels.
uint64_t scatter_plainly(const test::VolumeScene& scene, const volume::ShearFrame& frame, std::vector<glm::vec4>& slice,
                         std::vector<glm::vec4>& image) {
  std::fill(image.begin(), image.end(), glm::vec4(0));
  const int rows = scene.grid.size[1];
  uint64_t voxels = 0;
  for (int n = 0; n < scene.grid.size[2]; ++n) {
    const int k = frame.direction > 0 ? n : scene.grid.size[2] - 1 - n;
    const double t = frame.t(k);
    std::fill(slice.begin(), slice.end(), glm::vec4(0));
    for (int j = 0; j < rows; ++j)
      for (uint32_t v = scene.voxels.rows[size_t(k * rows + j)]; v < scene.voxels.rows[size_t(k * rows + j) + 1]; ++v) {
        const float x = float(((scene.voxels.i[v] - frame.eye[0]) / t - frame.u0) / frame.du) - 0.5f;
        const float y = float(((j - frame.eye[1]) / t - frame.v0) / frame.dv) - 0.5f;
        const int px = int(std::floor(x)), py = int(std::floor(y));
        if (px < 0 || py < 0 || px + 1 >= frame.width || py + 1 >= frame.height) continue;
        const auto& c = scene.colours[scene.voxels.level[v]];
        const glm::vec4 value = glm::vec4(c.r, c.g, c.b, 1) * c.extinction;
        glm::vec4* to = slice.data() + size_t(py) * size_t(frame.width) + px;
        const float fx = x - float(px), fy = y - float(py);
        to[0] += value * (1 - fx) * (1 - fy), to[1] += value * fx * (1 - fy);
        to[frame.width] += value * (1 - fx) * fy, to[frame.width + 1] += value * fx * fy;
        ++voxels;
      }
    for (size_t p = 0; p < slice.size(); ++p) {
      if (!(slice[p].w > 0)) continue;
      const float alpha = 1 - std::exp(-slice[p].w);
      image[p] += (1 - image[p].w) * alpha / slice[p].w * glm::vec4(glm::vec3(slice[p]), slice[p].w);
    }
  }
  return voxels;
}

volume::ShearFrame frame_of(const volume::Grid& grid, double pixels_a_voxel) {
  const auto view = camera(1024, 1024);
  auto frame = *volume::plan_frame(grid, std::span(&view, 1));
  const double width = frame.width * frame.du, height = frame.height * frame.dv;
  const double middle = frame.t((grid.size[size_t(frame.axis)] - 1) / 2.0);
  frame.du = frame.dv = 1 / (pixels_a_voxel * middle);
  frame.width = std::min(int(std::ceil(width / frame.du)), volume::kMaxRasterSide);
  frame.height = std::min(int(std::ceil(height / frame.dv)), volume::kMaxRasterSide);
  return frame;
}

void report(benchmark::State& state, const ShearStats& stats) {
  const double n = double(state.iterations());
  state.counters["Mvoxels/s"] = benchmark::Counter(double(stats.voxels) / 1e6 * n, benchmark::Counter::kIsRate);
  state.counters["Mpixels/s"] = benchmark::Counter(double(stats.pixels) / 1e6 * n, benchmark::Counter::kIsRate);
  state.counters["voxels"] = double(stats.voxels);
}

void VolumeSplat(benchmark::State& state) {
  const auto& scene = crusts(192);
  const auto frame = frame_of(scene.grid, double(state.range(0)));
  const SlabVolume volume(scene.grid, scene.voxels);
  ShearSplatter splatter(1);
  ShearStats stats;
  for (auto _ : state)
    benchmark::DoNotOptimize(splatter.splat(volume, scene.colours, frame, {0, scene.grid.size[2]}, &stats));
  report(state, stats);
}
BENCHMARK(VolumeSplat)->Arg(1)->Arg(2)->Arg(4)->Unit(benchmark::kMillisecond);

void VolumeScatterPlainly(benchmark::State& state) {
  const auto& scene = crusts(192);
  const auto frame = frame_of(scene.grid, 1);
  std::vector<glm::vec4> slice(size_t(frame.width) * size_t(frame.height)), image(slice.size());
  uint64_t voxels = 0;
  for (auto _ : state) {
    voxels = scatter_plainly(scene, frame, slice, image);
    benchmark::DoNotOptimize(image.data());
  }
  report(state, {voxels, 0, 0, 0, 0});
}
BENCHMARK(VolumeScatterPlainly)->Unit(benchmark::kMillisecond);

// A lower bound for splatters: reads the voxels once, as they are stored.
void VolumeReadVoxels(benchmark::State& state) {
  const auto& scene = crusts(192);
  const ShearRows rows = arrange(scene.grid, scene.voxels, 0);
  std::vector<ShearCell> copy(rows.cells.size());
  for (auto _ : state) {
    std::memcpy(copy.data(), rows.cells.data(), copy.size() * sizeof(ShearCell));
    benchmark::ClobberMemory();
  }
  report(state, {copy.size(), 0, 0, 0, 0});
}
BENCHMARK(VolumeReadVoxels)->Unit(benchmark::kMillisecond);

void VolumeArrange(benchmark::State& state) {
  const auto& scene = crusts(256);
  for (auto _ : state) benchmark::DoNotOptimize(arrange(scene.grid, scene.voxels, int(state.range(0))));
  report(state, {scene.voxels.size(), 0, 0, 0, 0});
}
BENCHMARK(VolumeArrange)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

// Argument: opacity of the most opaque level, percent.
void VolumeFrame(benchmark::State& state) {
  const auto& scene = crusts(256);
  const auto colours = test::ramp(double(state.range(0)) / 100);
  const auto view = camera(1600, 1200);
  const auto frame = *volume::plan_frame(scene.grid, std::span(&view, 1));
  const SlabVolume volume(scene.grid, scene.voxels);
  ShearSplatter splatter(1);
  ShearStats stats;
  for (auto _ : state)
    benchmark::DoNotOptimize(splatter.splat(volume, colours, frame, {0, scene.grid.size[2]}, &stats));
  report(state, stats);
}
BENCHMARK(VolumeFrame)->Arg(10)->Arg(50)->Arg(99)->Unit(benchmark::kMillisecond);

void VolumeRays(benchmark::State& state) {
  const auto& scene = crusts(128);
  const VolumeRaycaster reference(scene.grid, scene.voxels, scene.colours, 1);
  const auto view = camera(200, 150);
  for (auto _ : state) benchmark::DoNotOptimize(reference.draw(view, 0));
  state.counters["Mrays/s"] =
      benchmark::Counter(200 * 150 / 1e6 * double(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(VolumeRays)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat::sampler
