// Packing a frame of 1280x800 in tiles of 256x256, without the network: reference depth, elimination, encoding,
// insertion.
#include <benchmark/benchmark.h>

#include "tests/unit/packer_scenes.h"

namespace telesplat {
namespace {

std::vector<packer::SampledTile> frame(uint64_t id, double turn) {
  const glm::dvec3 eye(0.65 * std::cos(turn), 0.45, 0.65 * std::sin(turn));
  return test::sampled_frame({id}, geometry::make_camera(geometry::look_at(eye, {0, -0.1, 0}), 60, 1280, 800), 256);
}

// Argument: 0 = redundancy elimination, 1 = none (the baseline). Each iteration packs a view 3 degrees on from the
// last, on top of eight such frames.
void packer_frame(benchmark::State& state) {
  packer::Config config = test::packer_config();
  config.redundancy = state.range(0) ? packer::Redundancy::kKeep : packer::Redundancy::kEliminate;
  std::optional<packer::PackerCore> core;
  uint64_t id = 0, samples = 0, kept = 0;
  const auto submit = [&](std::vector<packer::SampledTile> tiles) {
    for (auto& tile : tiles) {
      const auto event = core->submit(std::move(tile), static_cast<double>(id));
      CHECK(event.ok() && event->has_value());
      samples += (*event)->samples, kept += (*event)->kept;
    }
  };
  for (auto _ : state) {
    state.PauseTiming();
    if (id % 16 == 0) {
      core.emplace(config, test::kEpoch);
      for (int i = 0; i < 8; ++i, ++id) submit(frame(id, 0.05 * static_cast<double>(id % 16)));
    }
    auto tiles = frame(id, 0.05 * static_cast<double>(id % 16));
    ++id;
    state.ResumeTiming();
    submit(std::move(tiles));
  }
  state.counters["kept"] = static_cast<double>(kept) / static_cast<double>(samples);
  state.counters["bytes_point"] =
      static_cast<double>(core->model().bytes()) / static_cast<double>(core->model().points());
  state.counters["per_sample"] =
      benchmark::Counter(static_cast<double>(samples) / static_cast<double>(id),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(packer_frame)->Arg(0)->Arg(1)->Iterations(16)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
