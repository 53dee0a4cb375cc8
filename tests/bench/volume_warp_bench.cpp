// volume_warp/*: sixteen layers over most of the display, a third of each layer's pixels not empty, seen a few degrees
// aside from where they were sampled. Times are wall-clock; core_ms is the sum over all threads. samples_ns: core time
// a bilinear look-up. bytes_floor: bytes that must cross the memory bus, each block of texels that is not empty read
// once and each pixel written once; floor_ms: the time for them at the bandwidth measured here on as many threads.
#include <benchmark/benchmark.h>

#include <cstring>
#include <map>
#include <thread>

#include "client/viewer/render/renderer.h"
#include "common/core/clock.h"
#include "tests/support/volume/frames.h"

namespace telesplat {
namespace {

using volume::VolumeFrame;

volume::Grid grid_of_bench() {
  volume::Grid grid{{256, 256, 256}, glm::dmat4(1)};
  grid.index_to_room = glm::translate(glm::dmat4(1), glm::dvec3(-0.5));
  grid.index_to_room = glm::scale(grid.index_to_room, glm::dvec3(1.0 / 255));
  return grid;
}

geometry::Camera view(int width, int height, double around) {
  const volume::Grid grid = grid_of_bench();
  return testing::looking_at(grid.centre_room(), testing::orbit(grid, 1.25, 0.3 + around, 0.2), width, height, 60);
}

enum Content { kOpaque, kThin };

// Blobs in a third of the pixels; thin: no blob is opaque enough to end the search behind it.
const VolumeFrame& frame_of(int width, int height, int content) {
  static std::map<std::array<int, 3>, VolumeFrame> made;
  const auto [at, is_new] = made.try_emplace({width, height, content});
  if (!is_new) return at->second;
  const volume::Grid grid = grid_of_bench();
  const auto camera = view(width, height, 0);
  const auto shear = volume::plan_frame(grid, std::span(&camera, 1)).value();
  std::vector<volume::SliceImage> images;
  for (int l = 0; l < static_cast<int>(shear.layers.size()); ++l) {
    images.push_back(testing::blobs(shear, l, {0, 0, shear.width, shear.height}));
    if (content == kThin)
      for (uint32_t& pixel : images.back().pixels) pixel = pixel >> 4 & 0x0f0f0f0f;
  }
  at->second = testing::frame_of(grid, shear, images);
  return at->second;
}

// Returns bytes a second, half of them read, half written.
double bandwidth(int threads) {
  static std::map<int, double> measured;
  double& out = measured[threads];
  if (out > 0) return out;
  constexpr size_t kBytes = size_t{32} << 20;
  std::vector<std::thread> workers;
  const auto copy = [&] {
    std::vector<char> from(kBytes, 1), to(kBytes, 2);
    for (int i = 0; i < 8; ++i) std::memcpy(to.data(), from.data(), kBytes), benchmark::DoNotOptimize(to.data());
  };
  copy();
  double best = 0;
  for (int round = 0; round < 3; ++round) {
    std::vector<std::vector<char>> from(static_cast<size_t>(threads), std::vector<char>(kBytes, 1)), to = from;
    const double start = monotonic_s();
    for (size_t t = 0; t < from.size(); ++t)
      workers.emplace_back([&, t] {
        for (int i = 0; i < 8; ++i)
          std::memcpy(to[t].data(), from[t].data(), kBytes), benchmark::DoNotOptimize(to[t].data());
      });
    for (auto& w : workers) w.join();
    workers.clear();
    best = std::max(best, 2.0 * 8 * kBytes * threads / (monotonic_s() - start));
  }
  return out = best;
}

double floor_bytes(const VolumeFrame& frame, const geometry::Camera& camera) {
  constexpr int kSide = volume::LayerImage::kBlock;
  double texels = 0;
  for (const auto& layer : frame.layers)
    for (int y = 0; y < layer.rows(); y += kSide)
      for (int x = 0; x < layer.pitch; x += kSide) {
        bool any = false;
        for (int j = y; j < std::min(y + kSide, layer.rows()) && !any; ++j)
          for (int i = x; i < std::min(x + kSide, layer.pitch); ++i)
            any |=
                layer.texels[static_cast<size_t>(j) * static_cast<size_t>(layer.pitch) + static_cast<size_t>(i)] != 0;
        texels += any ? kSide * kSide : 0;
      }
  return 4 * (texels + static_cast<double>(camera.width) * camera.height);
}

void run(benchmark::State& state, viewer::VolumeRenderer& renderer, int threads) {
  const int width = static_cast<int>(state.range(0)), height = width * 3 / 4;
  const VolumeFrame& frame = frame_of(width, height, static_cast<int>(state.range(1)));
  const auto camera = view(width, height, 0.05);
  std::vector<uint32_t> colour(static_cast<size_t>(width) * static_cast<size_t>(height));
  std::vector<float> depth(colour.size());
  const volume::WarpTarget target{width, height, colour.data(), state.range(3) ? depth.data() : nullptr};
  volume::WarpStats stats;
  renderer.render(&frame, camera, 0, target);
  double core_ms = 0, frames = 0;
  for (auto _ : state) {
    stats = renderer.render(&frame, camera, 0, target);
    core_ms += stats.warp_cpu_ms;
    ++frames;
  }
  state.counters["core_ms"] = core_ms / frames;
  state.counters["Msamples"] = static_cast<double>(stats.samples) * 1e-6;
  state.counters["sample_ns"] = core_ms / frames * 1e6 / static_cast<double>(stats.samples);
  const double bytes = floor_bytes(frame, camera);
  state.counters["floor_MB"] = bytes * 1e-6;
  state.counters["floor_ms"] = bytes / bandwidth(threads) * 1e3;
}

void volume_warp(benchmark::State& state) {
  const auto renderer = viewer::make_cpu_volume_renderer(static_cast<int>(state.range(2)));
  run(state, *renderer, static_cast<int>(state.range(2)));
}
BENCHMARK(volume_warp)
    ->ArgNames({"width", "thin", "threads", "depth"})
    ->Args({1600, kOpaque, 1, 0})
    ->Args({1600, kOpaque, 2, 0})
    ->Args({1600, kThin, 1, 0})
    ->Args({1600, kThin, 2, 0})
    ->Args({1600, kThin, 1, 1})
    ->Args({2560, kThin, 1, 0})
    ->Args({2560, kThin, 2, 0})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void volume_warp_gl(benchmark::State& state) {
  const auto renderer = viewer::make_volume_renderer("gl", 1);
  if (!renderer) return state.SkipWithError(renderer.error().text.c_str());
  run(state, **renderer, 2);
}
BENCHMARK(volume_warp_gl)
    ->ArgNames({"width", "thin", "threads", "depth"})
    ->Args({1600, kOpaque, 0, 0})
    ->Args({1600, kThin, 0, 0})
    ->Args({1600, kThin, 0, 1})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// Baseline: a display without a volume fills every pixel with one colour.
void volume_warp_baseline_fill(benchmark::State& state) {
  std::vector<uint32_t> colour(static_cast<size_t>(state.range(0) * state.range(0) * 3 / 4));
  for (auto _ : state) {
    std::fill(colour.begin(), colour.end(), 0xff203040u);
    benchmark::DoNotOptimize(colour.data());
  }
}
BENCHMARK(volume_warp_baseline_fill)
    ->ArgName("width")
    ->Arg(1600)
    ->Arg(2560)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// The worker's part, once a frame: turns decoded images into layers to warp; beside a copy of the images.
void volume_warp_merge(benchmark::State& state) {
  const VolumeFrame& frame = frame_of(1600, 1200, kThin);
  std::vector<volume::SliceImage> images;
  for (const auto& layer : frame.layers) {
    volume::SliceImage image{layer.layer, 0, 256, layer.rect, {}};
    for (int y = 0; y < layer.rect.height; ++y)
      image.pixels.insert(image.pixels.end(), layer.row(y), layer.row(y) + layer.rect.width);
    images.push_back(std::move(image));
  }
  for (auto _ : state) {
    if (state.range(0))
      benchmark::DoNotOptimize(std::vector<volume::SliceImage>(images).data());
    else
      benchmark::DoNotOptimize(volume::merge_layers(images, frame.shear).data());
  }
  state.counters["MB"] = static_cast<double>(frame.pixels()) * 4e-6;
}
BENCHMARK(volume_warp_merge)->ArgName("copy")->Arg(0)->Arg(1)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
