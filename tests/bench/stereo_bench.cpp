// stereo/*: making one picture of two eyes', per frame; copying both into it is the baseline.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "client/stereo/autostereo/interleaver.h"
#include "client/stereo/compose.h"

namespace telesplat {
namespace {

constexpr int kWidth = 2560, kHeight = 1600, kEyeWidth = 1024, kEyeHeight = 640;

image::View noise(int width, int height, uint32_t seed) {
  image::View out{width, height, std::vector<uint32_t>(size_t(width) * size_t(height)), {}};
  for (uint32_t& pixel : out.colour) pixel = 0xff000000u | ((seed = seed * 1664525u + 1013904223u) >> 8);
  return out;
}

// The personal display of T7.3.
stereo::Panel panel() {
  stereo::Panel out;
  out.width = kWidth, out.height = kHeight, out.eye = {kEyeWidth, kEyeHeight};
  out.pixel_m = 0.2505e-3, out.distance_m = 0.7;
  out.lines = {.pitch_m = 0.618e-3, .tilt_deg = 9.5, .gap_m = 0.2e-3, .thickness_m = 4.8e-3, .index = 1.49};
  return out;
}

void copied(benchmark::State& state) {
  const image::View left = noise(kWidth / 2, kHeight, 1), right = noise(kWidth / 2, kHeight, 2);
  image::View out;
  for (auto _ : state) {
    stereo::compose(stereo::Mode::kSideBySide, left, right, out, false);
    benchmark::DoNotOptimize(out.colour.data());
  }
}

// state.range(0): 1 if the eyes move from frame to frame.
void interleaved(benchmark::State& state) {
  const image::View left = noise(kEyeWidth, kEyeHeight, 1), right = noise(kEyeWidth, kEyeHeight, 2);
  stereo::Interleaver interleaver(panel());
  image::View out;
  double x = 0;
  for (auto _ : state) {
    if (state.range(0)) x = x > 0.05 ? -0.05 : x + 1e-3;
    interleaver.compose({glm::dvec3(x - 0.032, 0, 0.7), glm::dvec3(x + 0.032, 0, 0.7)}, left, right, out);
    benchmark::DoNotOptimize(out.colour.data());
  }
}

BENCHMARK(copied)->Name("stereo/side_by_side")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(interleaved)
    ->Name("stereo/autostereo")
    ->ArgName("moving")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace telesplat
