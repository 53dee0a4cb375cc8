#include "services/packer/points/elimination/known_points.h"

#include <algorithm>
#include <bit>
#include <bitset>
#include <vector>

#include "common/image/normal.h"
#include "common/points/unproject.h"

namespace telesplat::packer {
namespace {

struct Sample {
  points::ClusterKey key;
  uint32_t pixel;
  uint16_t x, y, z, normal;  // as in points::Mosaic
  float reach;               // in units of x, y and z
  uint64_t cell = 0;
};

// All of the tile, by leaves.
std::vector<Sample> samples_of(const points::ModelConfig& config, float nearest, const SampledTile& tile) {
  const points::OctreeGrid grid = points::octree_grid(config);
  const auto width = static_cast<size_t>(tile.rect.width);
  const double near_m = tile.camera.near_m * image::kMaxDepthCode;
  const double units = nearest / tile.camera.focal_x() / grid.leaf_size * 65536;
  std::vector<points::ClusterKey> keys(width);
  std::vector<uint16_t> x(width), y(width), z(width);
  std::vector<Sample> out;
  for (int row = 0; row < tile.rect.height; ++row) {
    const uint32_t first = static_cast<uint32_t>(row) * static_cast<uint32_t>(width);
    const uint32_t* codes = tile.image.depth.data() + first;
    if (std::all_of(codes, codes + width, [](uint32_t code) { return code == 0; })) continue;
    points::unproject_row(points::row_rays(grid, tile.camera, tile.rect.x, tile.rect.y + row), codes, width,
                          keys.data(), x.data(), y.data(), z.data());
    for (size_t i = 0; i < width; ++i)
      if (keys[i] != points::kNoCluster)
        out.push_back({keys[i], first + static_cast<uint32_t>(i), x[i], y[i], z[i], tile.image.normal[first + i],
                       static_cast<float>(near_m / codes[i] * units)});
  }
  std::sort(out.begin(), out.end(), [](const Sample& a, const Sample& b) { return a.key < b.key; });
  return out;
}

// Samples of a leaf, by cells that are as large as the farthest of them reaches.
class Cells {
 public:
  explicit Cells(std::span<Sample> samples) : samples_(samples) {
    float reach = 1;
    for (const Sample& s : samples) reach = std::max(reach, std::min(s.reach, 65535.0f));
    shift_ = std::bit_width(static_cast<uint32_t>(std::ceil(reach)) - 1);
    for (Sample& s : samples) {
      s.cell = cell(s.x, s.y, s.z);
      for_rows_around(s.cell, [&](uint64_t row) {
        for (uint64_t c = row; c < row + 3; ++c) near_.set(hash(c));
      });
    }
    std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.cell < b.cell; });
  }

  // Calls visit(sample) for those that may reach a point.
  void for_near(uint16_t x, uint16_t y, uint16_t z, const auto& visit) const {
    const uint64_t here = cell(x, y, z);
    if (!near_[hash(here)]) return;
    for_rows_around(here, [&](uint64_t row) {
      auto s = std::lower_bound(samples_.begin(), samples_.end(), row,
                                [](const Sample& sample, uint64_t c) { return sample.cell < c; });
      for (; s != samples_.end() && s->cell < row + 3; ++s) visit(*s);
    });
  }

 private:
  static constexpr size_t kHashed = 1 << 15;
  // From 1 on, so that there is one below.
  uint64_t cell(uint16_t x, uint16_t y, uint16_t z) const {
    const auto along = [&](uint16_t q) { return static_cast<uint64_t>(q >> shift_) + 1; };
    return along(x) | along(y) << 20 | along(z) << 40;
  }
  static size_t hash(uint64_t cell) { return cell * 0x9e3779b97f4a7c15ull >> 49; }
  // The first of three cells of each of the nine rows.
  static void for_rows_around(uint64_t cell, const auto& visit) {
    for (uint64_t z = 0; z < 3; ++z)
      for (uint64_t y = 0; y < 3; ++y)
        visit(cell - 1 + (y << 20) - (uint64_t{1} << 20) + (z << 40) - (uint64_t{1} << 40));
  }

  std::span<Sample> samples_;
  int shift_;
  std::bitset<kHashed> near_;
};

}  // namespace

uint64_t drop_known_points(const points::PointModel& model, float nearest, uint32_t group, SampledTile& tile) {
  std::vector<Sample> samples = samples_of(model.config(), nearest, tile);
  uint64_t dropped = 0;
  for (auto first = samples.begin(); first != samples.end();) {
    const auto end = std::find_if(first, samples.end(), [&](const Sample& s) { return s.key != first->key; });
    const points::Cluster* cluster = model.find(first->key);
    const std::span<Sample> of_leaf(first, end);
    first = end;
    if (!cluster) continue;
    const Cells cells(of_leaf);
    for (const points::Mosaic& mosaic : cluster->mosaics) {
      if (mosaic.provisional() && mosaic.group() != group) continue;
      const points::Mosaic::Level l = mosaic.level(0);
      const float own = nearest * 65536 / mosaic.pixel_range();
      for (uint32_t i = 0; i < l.count; ++i)
        cells.for_near(l.x[i], l.y[i], l.z[i], [&](const Sample& s) {
          const float x = float(s.x) - float(l.x[i]), y = float(s.y) - float(l.y[i]), z = float(s.z) - float(l.z[i]);
          if (tile.image.depth[s.pixel] == 0 || x * x + y * y + z * z > std::min(s.reach * s.reach, own * own)) return;
          if (glm::dot(image::decode_normal16(s.normal), image::decode_normal16(l.normal[i])) <= 0) return;
          tile.image.depth[s.pixel] = 0, tile.image.colour[s.pixel] = 0, tile.image.normal[s.pixel] = 0;
          ++dropped;
        });
    }
  }
  return dropped;
}

}  // namespace telesplat::packer
