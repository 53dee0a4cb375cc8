// What a lease costs the master: requests, leases and completions of frames of rows through MasterCore, without the network.
#include <benchmark/benchmark.h>

#include <chrono>
#include <filesystem>

#include "common/julia/parameters.h"
#include "services/master/master_core.h"

namespace telesplat {
namespace {

using Clock = std::chrono::steady_clock;

// Arguments: samplers; rows of a frame, 640 wide, a row a lease; 1 = with a record on disk. An iteration is a lease from request to
// completion. Only what MasterCore does is timed, encoding of leases included.
void master_leases(benchmark::State& state) {
  const auto samplers = size_t(state.range(0));
  const auto folder = std::filesystem::temp_directory_path() / "telesplat-master-bench";
  auto record = std::move(metrics::RunRecord::open(state.range(2) ? folder.string() : "")).value();
  master::MasterCore core({}, {1}, *record);
  const auto join = [&](const std::string& role, uint64_t instance) {
    wire::Hello h;
    h.role = role;
    h.name = role + std::to_string(instance);
    h.instance = {instance};
    if (role == "data") h.facts["kind"] = "julia", h.parameters = julia::to_map(julia::Parameters{});
    core.on(h.name, h, 0);
  };
  join("data", 1);
  join("packer", 2);
  join("viewer", 3);
  for (size_t i = 0; i < samplers; ++i) join("sampler", 10 + i);
  core.take_outgoing();

  double now_s = 0;
  uint64_t request = 0, leases = 0;
  std::vector<wire::Lease> out;
  for (auto _ : state) {
    Clock::duration spent{};
    const auto timed = [&](auto&& work) {
      const auto begin = Clock::now();
      work();
      spent += Clock::now() - begin;
    };
    wire::ViewRequest view;
    view.viewer = {3};
    view.request = {++request};
    view.camera.width = 640;
    view.camera.height = int(state.range(1));
    size_t frame_leases = 0;
    timed([&] { core.on("viewer3", view, now_s); });
    do {
      timed([&] {
        for (size_t i = 0; i < samplers; ++i) core.on("sampler" + std::to_string(10 + i), wire::LeaseRequest{}, now_s);
      });
      std::vector<master::Outgoing> sent;
      timed([&] { sent = core.take_outgoing(); });
      out.clear();
      for (const auto& m : sent)
        if (m.type == wire::Lease::kName) out.push_back(*wire::decode<wire::Lease>(std::as_bytes(std::span(m.body))));
      now_s += 0.0054;
      frame_leases += out.size();
      timed([&] {
        for (size_t i = 0; i < out.size(); ++i) {
          const wire::Lease& l = out[i];
          wire::TileDone done;
          done.frame = l.frame;
          done.tile = l.tile;
          done.lease = l.lease;
          done.sampler = {10 + i};
          done.step = l.step;
          done.rect = l.rect;
          done.sample_begin_s = l.leased_s;
          done.sample_end_s = done.encode_end_s = now_s;
          core.on("packer2", done, now_s);
        }
      });
    } while (!out.empty());
    // Idle requests stay; they are the next frame's first ones.
    leases += frame_leases;
    state.SetIterationTime(std::chrono::duration<double>(spent).count());
  }
  state.counters["per_lease"] =
      benchmark::Counter(double(leases), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["leases/s"] = benchmark::Counter(double(leases), benchmark::Counter::kIsRate);
  record.reset();
  if (state.range(2)) std::filesystem::remove_all(folder);
}
BENCHMARK(master_leases)
    ->ArgNames({"samplers", "rows", "record"})
    ->Args({1, 640, 0})
    ->Args({40, 640, 0})
    ->Args({40, 640, 1})
    ->Args({40, 16384, 0})
    ->Args({1000, 640, 0})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
