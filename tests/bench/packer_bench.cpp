// Packing a frame of 1280x800 in tiles of 256x256, without the network: reference depth, elimination, encoding,
// insertion.
#include <benchmark/benchmark.h>

#include <chrono>

#include "common/points/mosaic_builder.h"
#include "common/wire/serial.h"
#include "services/packer/points/block_gatherer.h"
#include "services/packer/points/obsolescence.h"
#include "tests/support/packer_scenes.h"

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

// Leases of rows, keep mode: a frame of 1024x640 arrives as messages of `rows` rows each, in blocks of 64; all that the
// packer does except the sockets: decodes messages, gathers blocks, packs, encodes, inserts, forgets points over the
// limit, reports each row done. 64 rows: tiles that are blocks, the baseline. Frames turn slowly, so that clusters have
// the six patches that they may have.
void packer_rows(benchmark::State& state) {
  constexpr int kWidth = 1024, kHeight = 640, kBlock = 64, kViews = 8;
  const int rows = static_cast<int>(state.range(0));
  std::vector<std::vector<std::string>> frames(kViews);
  for (int view = 0; view < kViews; ++view) {
    const glm::dvec3 eye(0.55 * std::cos(0.05 * view), 0.35, 0.55 * std::sin(0.05 * view));
    wire::DepthTile m;
    wire::Lease& lease = m.lease;
    lease.camera = geometry::make_camera(geometry::look_at(eye, {0, -0.1, 0}), 60, kWidth, kHeight);
    lease.epoch = test::kEpoch, lease.blocks_in_frame = kHeight / kBlock;
    for (int y = 0; y < kHeight; y += rows) {
      lease.tile = static_cast<uint64_t>(y / rows), lease.block = static_cast<uint64_t>(y / kBlock);
      lease.rect = {0, y, kWidth, rows};
      lease.block_rect = {0, y / kBlock * kBlock, kWidth, kBlock};
      const auto stream = codec::encode(test::sample_scene(lease.camera, lease.rect));
      m.image = std::as_bytes(std::span(stream));
      frames[static_cast<size_t>(view)].push_back(wire::encode(m));
    }
  }
  packer::Config config = test::packer_config();
  config.redundancy = packer::Redundancy::kKeep;
  packer::PackerCore core(config, test::kEpoch);
  packer::BlockGatherer gatherer;
  uint64_t frame = 0, samples = 0;
  double longest_ms = 0;  // for a single message
  const auto pack_frame = [&] {
    ++frame;
    for (const std::string& body : frames[frame % kViews]) {
      const auto begin = std::chrono::steady_clock::now();
      const auto m = wire::decode<wire::DepthTile>(std::as_bytes(std::span(body)));
      const wire::Lease& lease = m->lease;
      const std::span stream(reinterpret_cast<const uint8_t*>(m->image.data()), m->image.size());
      const packer::FramePart block{.frame = {frame},
                                    .epoch = lease.epoch,
                                    .viewer = lease.viewer,
                                    .request = lease.request,
                                    .tile = uint32_t(lease.block),
                                    .tiles_in_frame = uint32_t(lease.blocks_in_frame),
                                    .camera = lease.camera,
                                    .rect = lease.block_rect};
      auto got = gatherer.add({block, {}}, lease.rect, stream);
      CHECK(got.ok() && got->has_value());
      samples += (*got)->samples;
      if ((*got)->block) {
        std::shared_ptr<const std::vector<uint8_t>> ready;
        if ((*got)->is_block) ready = std::make_shared<const std::vector<uint8_t>>(stream.begin(), stream.end());
        const auto event = core.submit(std::move(*(*got)->block), static_cast<double>(frame), ready);
        CHECK(event.ok() && event->has_value());
        benchmark::DoNotOptimize(wire::encode(wire::Patch{.image = std::as_bytes(std::span(*(*event)->blob))}));
      }
      benchmark::DoNotOptimize(wire::encode(wire::TileDone{.rect = lease.rect}));
      longest_ms = std::max(
          longest_ms, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    }
    core.tick(static_cast<double>(frame));
  };
  for (int i = 0; i < 8; ++i) pack_frame();
  longest_ms = 0;
  for (auto _ : state) pack_frame();
  state.counters["us_per_row"] =
      benchmark::Counter(kHeight * 1e-6, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["covered"] = static_cast<double>(samples) / (static_cast<double>(frame) * kWidth * kHeight);
  state.counters["longest_ms"] = longest_ms;
}
BENCHMARK(packer_rows)->ArgName("rows")->Arg(1)->Arg(4)->Arg(64)->Unit(benchmark::kMillisecond);

// The packer's choice once a second: 17000 clusters of six patches. Argument: per cent of the points that must go.
void packer_choose_patches(benchmark::State& state) {
  packer::PatchObsolescence obsolescence;
  uint64_t points = 0, patches = 0;
  for (uint32_t cluster = 0; cluster < 17000; ++cluster)
    for (uint32_t frame = 0; frame < 6; ++frame) {
      const uint32_t n = 20 + (cluster * 7 + frame * 13) % 60;
      points::MosaicBuilder builder({frame + 1}, {frame + 1}, {n, n, n});
      for (auto* plane : {builder.x, builder.y, builder.z, builder.normal}) std::fill_n(plane, n, uint16_t{0});
      std::fill_n(builder.colour, n, 0u);
      obsolescence.added(cluster, builder.finish(static_cast<float>(8 + (cluster + frame) % 9), {0, 0, 1}),
                         (cluster * 31 + frame * 17) % 97);
      points += n, ++patches;
    }
  packer::PatchLimits limits{.obsolete_after_s = 1000, .patches_per_cluster = 6};
  const auto per_cent = static_cast<uint64_t>(state.range(0));
  limits.max_points = per_cent > 0 ? points * (100 - per_cent) / 90 : 0;
  size_t chosen = 0;
  for (auto _ : state) chosen = obsolescence.choose(limits, 100).size();
  state.counters["patches"] = static_cast<double>(patches);
  state.counters["chosen"] = static_cast<double>(chosen);
}
BENCHMARK(packer_choose_patches)->ArgName("per_cent")->Arg(0)->Arg(11)->Arg(50)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
