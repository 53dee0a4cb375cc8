// Seen space at 2560x1600: times a step of a walk around the scene, after a walk that has seen most of it.
#include <benchmark/benchmark.h>

#include <limits>

#include "services/packer/points/plan/known_empty.h"
#include "tests/support/points_scenes.h"

namespace telesplat {
namespace {

constexpr int kSteps = 24;

struct Step {
  geometry::Camera camera;
  std::vector<float> depth_m;
  points::PreparedPatch patch;
};

std::vector<Step> walk(int width, int height, const points::ModelConfig& model) {
  std::vector<Step> out;
  for (int i = 0; i < kSteps; ++i) {
    Step step;
    const double turn = 0.04 * i;
    step.camera = test::scene_camera({0.8 * std::cos(turn), 0.3, 0.8 * std::sin(turn)}, width, height);
    const geometry::Rect all{0, 0, width, height};
    const image::DepthImage image = test::sample_scene(step.camera, all);
    for (const uint32_t code : image.depth)
      step.depth_m.push_back(code == 0 ? std::numeric_limits<float>::infinity()
                                       : static_cast<float>(image::decode_depth(code, step.camera.near_m)));
    step.patch = points::prepare_patch(model, {static_cast<uint64_t>(i) + 1}, step.camera, all, image);
    out.push_back(std::move(step));
  }
  return out;
}

// Argument: 0 = project, 1 = carve, 2 = add a view's points (4 million, most of them in known blocks); 3 = the first
// carve of an epoch; 4 = an epoch begins.
void known_empty(benchmark::State& state) {
  const points::ModelConfig model = test::scene_config(5);
  static const std::vector<Step> steps = walk(2560, 1600, model);
  packer::KnownEmpty space(model);
  image::PixelMask mask;
  size_t at = 0, pixels = 0;
  for (; at < kSteps / 2; ++at) space.add(steps[at].patch), space.carve(steps[at].camera, steps[at].depth_m, 2);
  const int64_t what = state.range(0);
  for (auto _ : state) {
    state.PauseTiming();
    if (at == kSteps) {
      space.clear();
      for (at = 0; at < kSteps / 2; ++at)
        space.add(steps[at].patch), space.carve(steps[at].camera, steps[at].depth_m, 2);
    }
    const Step& step = steps[what >= 3 ? 0 : at];
    if (what == 3) space.clear(), space.add(step.patch);
    if (what == 1) space.add(step.patch);
    state.ResumeTiming();
    if (what == 0) space.project(step.camera, step.depth_m, 2, mask);
    if (what == 1 || what == 3) space.carve(step.camera, step.depth_m, 2);
    if (what == 2) space.add(step.patch);
    if (what == 4) space.clear();
    state.PauseTiming();
    if (what == 0) pixels += mask.count(), space.add(step.patch), space.carve(step.camera, step.depth_m, 2);
    if (what == 2) space.carve(step.camera, step.depth_m, 2);
    if (what < 3) ++at;
    state.ResumeTiming();
  }
  state.counters["pixels"] = benchmark::Counter(static_cast<double>(pixels), benchmark::Counter::kAvgIterations);
}
BENCHMARK(known_empty)
    ->ArgName("project_carve_add_first_epoch")
    ->DenseRange(0, 4)
    ->Iterations(kSteps / 2)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
}  // namespace telesplat
