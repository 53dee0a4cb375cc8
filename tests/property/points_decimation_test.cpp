// Levels of detail against a plain, slow decimation by the contract: any mask, any cut, any octree depth.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "common/points/point_model.h"
#include "common/points/unproject.h"
#include "tests/support/points_scenes.h"

namespace telesplat::points {
namespace {

struct Sample {
  int x, y;  // pixel of the frame
  ClusterKey key;
  uint32_t code, colour;
  uint16_t qx, qy, qz, normal;
  auto content() const { return std::make_tuple(key, qx, qy, qz, normal, colour); }
};
using Contents = std::multiset<decltype(Sample().content())>;

std::vector<Sample> unproject(const ModelConfig& config, const geometry::Camera& camera, const geometry::Rect& tile,
                              const image::DepthImage& image) {
  std::vector<Sample> out;
  const OctreeGrid grid = octree_grid(config);
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      const size_t i = static_cast<size_t>(y) * tile.width + x;
      Sample s{tile.x + x, tile.y + y, kNoCluster, image.depth[i], image.colour[i], 0, 0, 0, image.normal[i]};
      unproject_row_scalar(row_rays(grid, camera, s.x, s.y), &s.code, 1, &s.key, {&s.qx, &s.qy, &s.qz});
      if (s.key != kNoCluster) out.push_back(s);
    }
  }
  return out;
}

// Makes level l + 1 from level l, block by block.
std::vector<Sample> decimate(const std::vector<Sample>& fine, int l) {
  const int side = 2 << l;
  const auto z_order = [&](const Sample& s) {
    int code = 0;
    for (int b = 0; b < l + 1; ++b) code |= (s.x >> b & 1) << (2 * b) | (s.y >> b & 1) << (2 * b + 1);
    return code;
  };
  std::map<std::pair<int, int>, std::vector<Sample>> blocks;
  for (const Sample& s : fine) blocks[{s.y / side, s.x / side}].push_back(s);
  std::vector<Sample> out;
  for (auto& [at, rest] : blocks) {
    std::sort(rest.begin(), rest.end(), [&](const Sample& a, const Sample& b) { return z_order(a) < z_order(b); });
    while (!rest.empty()) {
      const Sample first = rest.front();
      std::vector<Sample> group, left;
      for (const Sample& s : rest) {
        const double ratio = static_cast<double>(first.code) / s.code;  // depth over the first sample's
        (s.key == first.key && ratio > 0.98 - 1e-9 && ratio < 1.02 + 1e-9 ? group : left).push_back(s);
      }
      Sample nearest = group.front();
      const auto distance = [&, &at = at](const Sample& s) {
        return std::hypot(s.x + 0.5 - (at.second + 0.5) * side, s.y + 0.5 - (at.first + 0.5) * side);
      };
      uint32_t sum[3] = {};
      for (const Sample& s : group) {
        if (distance(s) < distance(nearest) - 1e-9) nearest = s;
        for (int c = 0; c < 3; ++c) sum[c] += s.colour >> (8 * c) & 255;
      }
      nearest.colour = 0;
      const auto n = static_cast<uint32_t>(group.size());
      for (int c = 0; c < 3; ++c) nearest.colour |= (sum[c] + n / 2) / n << (8 * c);
      out.push_back(nearest);
      rest = left;
    }
  }
  return out;
}

class Decimation : public testing::TestWithParam<int> {};

TEST_P(Decimation, MosaicsHoldWhatTheContractSays) {
  std::mt19937_64 random(static_cast<uint64_t>(GetParam()));
  const ModelConfig config = test::scene_config(static_cast<int>(random() % 8));
  const geometry::Camera camera = test::scene_camera(test::random_eye(random), 160, 100);
  const geometry::Rect tile{static_cast<int>(random() % 40), static_cast<int>(random() % 40),
                            1 + static_cast<int>(random() % 100), 1 + static_cast<int>(random() % 60)};
  image::DepthImage image = test::sample_scene(camera, tile);
  const double fractions[] = {1, 0.97, 0.5, 0.1};
  test::mask_randomly(image, fractions[random() % 4], random());
  if (random() % 3 == 0)  // rough depths: several surfaces in a block
    for (uint32_t& d : image.depth)
      if (d != 0) d -= static_cast<uint32_t>(random() % (d / 16));

  const PreparedPatch patch = prepare_patch(config, {5}, camera, tile, image);
  std::vector<Sample> expected = unproject(config, camera, tile, image);
  for (int l = 0; l < kLevels; ++l) {
    Contents want, got;
    for (const Sample& s : expected) want.insert(s.content());
    for (const auto& [key, mosaic] : patch.mosaics) {
      const Mosaic::Level v = mosaic.level(l);
      for (uint32_t i = 0; i < v.count; ++i) got.insert({key, v.x[i], v.y[i], v.z[i], v.normal[i], v.colour[i]});
    }
    ASSERT_EQ(want, got) << "level " << l;
    expected = decimate(expected, l);
  }

  // A second run gives the same bytes.
  PointModel a(config), b(config);
  a.insert(prepare_patch(config, {5}, camera, tile, image));
  b.insert(prepare_patch(config, {5}, camera, tile, image));
  EXPECT_EQ(a.digest(), b.digest());
}

INSTANTIATE_TEST_SUITE_P(Seeds, Decimation, testing::Range(1, 61));

}  // namespace
}  // namespace telesplat::points
