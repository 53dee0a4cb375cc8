#include "tools/telesplat/bench/surfel_grid.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/points/compaction.h"
#include "common/points/mosaic_builder.h"

namespace telesplat::launcher {
namespace {

constexpr int kFinest = 8;  // 2^9 cells along a leaf's edge

// Cells of level l: 2^(l + 1) along a leaf's edge, so that a sample's footprint is one to two of them.
uint64_t cell_key(points::ClusterKey cluster, int level, uint16_t x, uint16_t y, uint16_t z) {
  const int shift = 15 - level;
  return uint64_t{cluster} << 32 | uint64_t(level) << 27 | uint64_t(x >> shift) << 18 | uint64_t(y >> shift) << 9 |
         uint64_t(z >> shift);
}

}  // namespace

void SurfelGrid::add(const points::PreparedPatch& view) {
  for (const auto& [cluster, mosaic] : view.mosaics) {
    const int level = std::clamp(points::density_class(mosaic.pixel_range()), 0, kFinest);
    const points::Mosaic::Level l = mosaic.level(0);
    for (uint32_t i = 0; i < l.count; ++i) {
      const uint64_t key = cell_key(cluster, level, l.x[i], l.y[i], l.z[i]);
      if (refined_.contains(key)) continue;
      if (!cells_.try_emplace(key, Sample{l.x[i], l.y[i], l.z[i], l.normal[i], l.colour[i]}).second) continue;
      for (int coarser = level - 1; coarser >= 0; --coarser) {
        const uint64_t above = cell_key(cluster, coarser, l.x[i], l.y[i], l.z[i]);
        cells_.erase(above);
        if (!refined_.insert(above).second) break;
      }
    }
  }
}

points::PointModel SurfelGrid::model() const {
  std::map<std::pair<int, points::ClusterKey>, std::vector<const Sample*>> parts;
  for (const auto& [key, sample] : cells_)
    parts[{int(key >> 27 & 31), points::ClusterKey(key >> 32)}].push_back(&sample);
  points::PointModel out(config_);
  std::map<int, points::PreparedPatch> patches;
  for (const auto& [of, samples] : parts) {
    const auto n = uint32_t(samples.size());
    points::MosaicBuilder builder({1}, {}, {n, n, n});
    for (uint32_t i = 0; i < n; ++i) {
      const Sample& s = *samples[i];
      builder.x[i] = s.x, builder.y[i] = s.y, builder.z[i] = s.z;
      builder.normal[i] = s.normal, builder.colour[i] = s.colour;
    }
    // The middle of the pixel ranges that fall into the level.
    const points::Mosaic mosaic = builder.finish(1.5f * std::ldexp(1.0f, of.first), glm::vec3(0));
    const Sequence sequence{uint64_t(of.first) + 1};
    auto& patch = patches[of.first];
    patch.sequence = sequence;
    patch.mosaics.emplace_back(of.second, points::merge_mosaics({&mosaic}, sequence));
  }
  for (auto& [level, patch] : patches) out.insert(std::move(patch));
  return out;
}

}  // namespace telesplat::launcher
