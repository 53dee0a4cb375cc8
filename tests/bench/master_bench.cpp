// Costs of a lease for the master: requests, leases and completions of frames of rows through MasterCore, without the
// network.
#include <benchmark/benchmark.h>

#include <chrono>
#include <filesystem>
#include <random>

#include "common/julia/parameters.h"
#include "common/volume/session.h"
#include "services/master/master_core.h"
#include "services/master/slabs/assignment.h"

namespace telesplat {
namespace {

using Clock = std::chrono::steady_clock;

// Arguments: samplers; rows of a frame, 640 wide, a row a lease; 1 = with a record on disk. An iteration is a lease
// from request to completion. Only what MasterCore does is timed, encoding of leases included.
void master_leases(benchmark::State& state) {
  const auto samplers = size_t(state.range(0));
  const auto folder = std::filesystem::temp_directory_path() / "telesplat-master-bench";
  auto record = std::move(metrics::RunRecord::open(state.range(2) ? folder.string() : "")).value();
  master::MasterCore core({.settings = {.steering = false}}, {1}, *record);
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
          done.moments.sample_begin_s = l.moments.leased_s;
          done.moments.sample_end_s = done.moments.encode_end_s = now_s;
          core.on("packer2", done, now_s);
        }
      });
    } while (!out.empty());
    // Idle requests stay: the next frame answers them first.
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

// Arguments: senders, receivers, transfers. Baseline in the same run: the same transfers coloured in their given order.
// `rounds_ratio`: rounds over the least possible number (1); `time`, `time_plain`: the sum of each round's longest
// transfer, over the busiest node's bytes, with and without regard for bytes.
void master_scatter(benchmark::State& state) {
  std::mt19937 random(1);
  std::lognormal_distribution<double> bytes(10, 1);
  std::vector<master::Transfer> transfers;
  for (int64_t i = 0; i < state.range(2); ++i)
    transfers.push_back({uint32_t(random() % uint64_t(state.range(0))), uint32_t(random() % uint64_t(state.range(1))),
                         uint64_t(bytes(random))});
  std::map<uint32_t, uint64_t> load;
  for (const auto& t : transfers) load[t.sender] += t.bytes, load[(1u << 31) + t.receiver] += t.bytes;
  uint64_t busiest = 0;
  for (const auto& [node, sum] : load) busiest = std::max(busiest, sum);
  master::AssignmentSheet sheet;
  for (auto _ : state) sheet = *master::schedule_scatter(transfers);
  const auto plain = *master::schedule_scatter(transfers, 0, false);
  state.counters["rounds"] = sheet.rounds;
  state.counters["rounds_ratio"] = double(sheet.rounds) / double(master::busiest(transfers));
  state.counters["time"] = double(sheet.makespan(transfers)) / double(busiest);
  state.counters["time_plain"] = double(plain.makespan(transfers)) / double(busiest);
}
BENCHMARK(master_scatter)
    ->ArgNames({"senders", "receivers", "transfers"})
    ->Args({4, 3, 10})
    ->Args({2, 40, 120})
    ->Args({16, 64, 1024})
    ->Args({64, 64, 16384})
    ->Args({1024, 1024, 65536})
    ->Unit(benchmark::kMillisecond);

// A volume's frame: request, a slice lease for each sampler, completion of each. Arguments: samplers.
void master_slices(benchmark::State& state) {
  const auto samplers = uint64_t(state.range(0));
  auto record = std::move(metrics::RunRecord::open("")).value();
  master::MasterCore core({.settings = {.steering = false}}, {1}, *record);
  const auto join = [&](const std::string& role, uint64_t instance) {
    wire::Hello h;
    h.role = role;
    h.name = role + std::to_string(instance);
    h.instance = {instance};
    if (role == "data") {
      volume::Session s;
      s.grid.size = {512, 512, 512};
      s.grid.index_to_room = glm::dmat4(0.002);
      s.grid.index_to_room[3][3] = 1;
      s.transfer.points = {{}};
      h.parameters = volume::to_parameters(s);
      h.facts = volume::to_facts(s);
      h.facts["kind"] = "volume";
      h.endpoints = {{"voxels", "tcp://data"}};
    }
    core.on(h.name, h, 0);
  };
  join("packer", 2);
  join("viewer", 3);
  for (uint64_t i = 0; i < samplers; ++i) join("sampler", 10 + i);
  join("data", 1);
  wire::SliceWeights weights;
  weights.data = {1};
  weights.epoch = {1};
  weights.voxels.assign(512, 10'000);
  if (!core.on("data1", weights, 0)) state.SkipWithError("weights are refused");
  for (uint64_t i = 0; i < samplers; ++i)
    core.on("sampler" + std::to_string(10 + i), wire::SlabReady{{10 + i}, 1, {1}, 1, 1}, 0);
  core.take_outgoing();
  uint64_t request = 0, leases = 0;
  for (auto _ : state) {
    wire::ViewRequest view;
    view.viewer = {3};
    view.request = {++request};
    view.camera = geometry::make_camera({.position_room = {0.5, 0.5, 3}}, 60, 1600, 1200);
    core.on("viewer3", view, 0);
    for (uint64_t i = 0; i < samplers; ++i) core.on("sampler" + std::to_string(10 + i), wire::LeaseRequest{}, 0);
    for (const auto& m : core.take_outgoing()) {
      if (m.type != wire::SliceLease::kName) continue;
      const auto l = *wire::decode<wire::SliceLease>(std::as_bytes(std::span(m.body)));
      wire::TileDone done;
      done.frame = l.frame;
      done.tile = l.slab;
      done.lease = l.lease;
      core.on("packer2", done, 0);
      ++leases;
    }
  }
  if (core.counters().at("frames_completed") != double(request)) state.SkipWithError("frames are not complete");
  state.counters["per_lease"] =
      benchmark::Counter(double(leases), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(master_slices)->ArgName("samplers")->Arg(1)->Arg(4)->Arg(40)->Arg(500)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace telesplat
