// A data server's work on a volume: classification and the voxel codec, beside a copy of the dense slab and zstd on it.
// Mvoxel/s: visible voxels per second on one core (classify: on all). B/voxel: bytes per visible voxel.
#include <benchmark/benchmark.h>
#include <zstd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>

#include "services/data/volume/store.h"

namespace telesplat::data {
namespace {

constexpr int kSide = 256, kSlices = 64;  // slices coded at a time, as in an answer

// Shells and tubes with the noise of a scanner: surfaces, thin parts and solid ones.
Volume made_up(int side, VoxelType type) {
  Volume v;
  v.size = {side, side, side}, v.type = type, v.format = "made up";
  const int most = type == VoxelType::kU8 ? 255 : 4095;
  v.lo = 0, v.hi = most;
  v.stored.resize(size_t(side) * size_t(side) * size_t(side) * voxel_bytes(type));
  std::mt19937 random(1);
  size_t n = 0;
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i, ++n) {
        const double x = 2.0 * i / side - 1, y = 2.0 * j / side - 1, z = 2.0 * k / side - 1;
        const double r = std::sqrt(x * x + y * y + z * z);
        double value = 0.75 * std::exp(-400 * (r - 0.8) * (r - 0.8)) + (r < 0.4 ? 0.4 : 0);
        value +=
            0.8 * std::exp(-300 * (std::pow(x - 0.3 * std::sin(5 * z), 2) + std::pow(y - 0.3 * std::cos(5 * z), 2)));
        value = std::clamp(value + 0.01 * double(int(random() % 5) - 2), 0.0, 1.0) * most;
        if (type == VoxelType::kU8) {
          v.stored[n] = std::byte(value);
        } else {
          const uint16_t stored = uint16_t(value);
          std::memcpy(&v.stored[2 * n], &stored, 2);
        }
      }
  return v;
}

struct Scene {
  std::unique_ptr<VolumeStore> store;
  volume::LevelSet shown;
  volume::Voxels voxels;  // voxels of kSlices slices in the middle
};

// name: "u8", "u16", or a volume of the real data.
const Scene* scene(const std::string& name) {
  static std::map<std::string, Scene> scenes;
  if (const auto found = scenes.find(name); found != scenes.end())
    return found->second.store ? &found->second : nullptr;
  Scene& s = scenes[name];
  const auto quiet = [](const char*, double) {};
  if (name == "u8" || name == "u16") {
    const VolumeOptions options{.transfer = "0:#000000:0, 10%:#000000:0, 10%:#ffffff:0.1, 100%:#ffffff:0.9"};
    const auto read = [&](size_t, const ReadProgress&) -> Result<Volume> {
      return made_up(kSide, name == "u8" ? VoxelType::kU8 : VoxelType::kU16);
    };
    s.store = std::move(*VolumeStore::make(read, 1, name, options, {}, quiet));
  } else {
    const char* const data = std::getenv("TELESPLAT_DATA");
    const char* const home = std::getenv("HOME");
    const auto path = std::filesystem::path(data ? data : std::string(home ? home : "") + "/.cache/telesplat-data") /
                      "volumes" / name;
    if (!std::filesystem::exists(path)) return nullptr;
    auto store = VolumeStore::open(path.string(), {}, {}, quiet);
    if (!store) return nullptr;
    s.store = std::move(*store);
  }
  const volume::Session& session = s.store->session();
  s.shown = shown_levels(session.transfer, session.levels);
  const int middle = session.grid.size[2] / 2, half = std::min(kSlices / 2, middle);
  s.voxels = *s.store->voxels(0, middle - half, middle + half, s.shown, {});
  return &s;
}

void report(benchmark::State& state, uint64_t voxels, double bytes_per_voxel) {
  state.counters["Mvoxel/s"] =
      benchmark::Counter(double(voxels) * double(state.iterations()) / 1e6, benchmark::Counter::kIsRate);
  if (bytes_per_voxel > 0) state.counters["B/voxel"] = bytes_per_voxel;
}

void classify(benchmark::State& state, const std::string& name) {
  const Scene* const s = scene(name);
  if (!s) return state.SkipWithError("no such data here (set TELESPLAT_DATA)");
  const int slices = s->store->session().grid.size[2];
  uint64_t voxels = 0;
  for (auto _ : state) voxels = s->store->voxels(0, 0, slices, s->shown, {})->size();
  report(state, voxels, 0);
}
void weigh(benchmark::State& state, const std::string& name) {
  const Scene* const s = scene(name);
  if (!s) return state.SkipWithError("no such data here (set TELESPLAT_DATA)");
  for (auto _ : state) benchmark::DoNotOptimize(s->store->slice_weights(0, s->shown));
}

void encode(benchmark::State& state, const std::string& name) {
  const Scene* const s = scene(name);
  if (!s) return state.SkipWithError("no such data here (set TELESPLAT_DATA)");
  const auto& size = s->store->session().grid.size;
  size_t bytes = 0;
  for (auto _ : state) bytes = volume::encode_voxels(s->voxels, size[0], size[1]).size();
  report(state, s->voxels.size(), double(bytes) / double(s->voxels.size()));
}
void decode(benchmark::State& state, const std::string& name) {
  const Scene* const s = scene(name);
  if (!s) return state.SkipWithError("no such data here (set TELESPLAT_DATA)");
  const auto& session = s->store->session();
  const auto& size = session.grid.size;
  const auto bytes = volume::encode_voxels(s->voxels, size[0], size[1]);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        volume::decode_voxels(bytes, size[0], size[1], s->voxels.k_begin, s->voxels.k_end, session.levels.count));
  report(state, s->voxels.size(), double(bytes.size()) / double(s->voxels.size()));
}

// The baselines: the same slices dense, two bytes a level and two a normal, transparent voxels 0.
std::vector<uint8_t> dense(const Scene& s) {
  const size_t size_x = size_t(s.store->session().grid.size[0]), rows = s.voxels.rows.size() - 1;
  std::vector<uint8_t> out(rows * size_x * 4);
  for (size_t r = 0; r < rows; ++r)
    for (size_t n = s.voxels.rows[r]; n < s.voxels.rows[r + 1]; ++n) {
      const uint16_t sample[2] = {s.voxels.level[n], s.voxels.normal[n]};
      std::memcpy(&out[(r * size_x + s.voxels.i[n]) * 4], sample, 4);
    }
  return out;
}
void dense_copy(benchmark::State& state, const std::string& name) {
  const Scene* const s = scene(name);
  if (!s) return state.SkipWithError("no such data here (set TELESPLAT_DATA)");
  const auto from = dense(*s);
  std::vector<uint8_t> to(from.size());
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::ClobberMemory();
  }
  report(state, s->voxels.size(), double(from.size()) / double(s->voxels.size()));
}
void dense_zstd(benchmark::State& state, const std::string& name, int level) {
  const Scene* const s = scene(name);
  if (!s) return state.SkipWithError("no such data here (set TELESPLAT_DATA)");
  const auto from = dense(*s);
  std::vector<uint8_t> to(ZSTD_compressBound(from.size()));
  size_t bytes = 0;
  for (auto _ : state) bytes = ZSTD_compress(to.data(), to.size(), from.data(), from.size(), level);
  report(state, s->voxels.size(), double(bytes) / double(s->voxels.size()));
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto function) {
    benchmark::RegisterBenchmark(name.c_str(), function)->Unit(benchmark::kMillisecond);
  };
  for (const std::string name : {"u8", "u16", "bonsai.nii.gz", "avm-angio.nii.gz", "alderson-ct-512x512x199.mha"}) {
    const std::string prefix = "volume_data/" + name + "/";
    add(prefix + "classify", [name](benchmark::State& s) { classify(s, name); });
    add(prefix + "weigh", [name](benchmark::State& s) { weigh(s, name); });
    add(prefix + "encode", [name](benchmark::State& s) { encode(s, name); });
    add(prefix + "decode", [name](benchmark::State& s) { decode(s, name); });
    add(prefix + "dense_copy", [name](benchmark::State& s) { dense_copy(s, name); });
    add(prefix + "dense_zstd_1", [name](benchmark::State& s) { dense_zstd(s, name, 1); });
    add(prefix + "dense_zstd_3", [name](benchmark::State& s) { dense_zstd(s, name, 3); });
  }
  return true;
}();

}  // namespace
}  // namespace telesplat::data
