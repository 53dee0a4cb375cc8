// Small volumes in memory, and stores of them.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>

#include "services/data/volume/store.h"

namespace telesplat::data {

// A volume whose voxel (i, j, k) stores f(i, j, k).
template <class T, class F>
Volume make_volume(std::array<int, 3> size, VoxelType type, const F& f) {
  Volume v;
  v.size = size, v.type = type, v.format = "test";
  v.lo = std::numeric_limits<double>::infinity(), v.hi = -v.lo;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const T value = T(f(i, j, k));
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        v.stored.insert(v.stored.end(), bytes, bytes + sizeof value);
        if (!std::isfinite(double(value))) continue;
        v.lo = std::min(v.lo, double(value)), v.hi = std::max(v.hi, double(value));
      }
  return v;
}
inline Volume noise(uint32_t seed = 1, std::array<int, 3> size = {19, 11, 13}) {
  std::mt19937 random(seed);
  return make_volume<uint8_t>(size, VoxelType::kU8, [&](int, int, int) { return random() % 256; });
}

inline Result<std::unique_ptr<VolumeStore>> open_steps(std::vector<Volume> steps, VolumeOptions options = {},
                                                       PlacementOptions mesh = {},
                                                       std::atomic<size_t>* reads = nullptr) {
  if (options.transfer.empty()) options.transfer = "0:#ffffff:0, 100%:#ffffff:1";
  const size_t count = steps.size();
  auto shared = std::make_shared<std::vector<Volume>>(std::move(steps));
  const auto read = [shared, reads](size_t step, const ReadProgress&) -> Result<Volume> {
    if (reads) ++*reads;
    return (*shared)[step];
  };
  return VolumeStore::make(read, count, "test", options, mesh, [](const char*, double) {});
}
inline std::unique_ptr<VolumeStore> open_or_fail(Volume v, VolumeOptions options = {}, PlacementOptions mesh = {}) {
  std::vector<Volume> steps;
  steps.push_back(std::move(v));
  auto store = open_steps(std::move(steps), options, mesh);
  EXPECT_TRUE(store) << store.error().text;
  return store ? std::move(*store) : nullptr;
}

inline volume::LevelSet levels_between(int begin, int end) {
  volume::LevelSet out;
  for (int l = begin; l < end; ++l) out.add(l);
  return out;
}
inline volume::Voxels voxels_or_fail(VolumeStore& store, int begin, int end, const volume::LevelSet& shown,
                                     const volume::LevelSet& have = {}, int step = 0) {
  auto v = store.voxels(step, begin, end, shown, have);
  EXPECT_TRUE(v) << v.error().text;
  return v ? std::move(*v) : volume::Voxels{};
}

}  // namespace telesplat::data
