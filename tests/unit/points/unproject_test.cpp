// Every instruction set unprojects to the same bits as the plain loop, at every tail length.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "common/points/unproject.h"
#include "tests/support/points_scenes.h"

namespace telesplat::points {
namespace {

struct Row {
  std::vector<ClusterKey> keys;
  std::vector<uint16_t> x, y, z;
  explicit Row(size_t n) : keys(n), x(n), y(n), z(n) {}
};

class UnprojectOnTarget : public testing::TestWithParam<int64_t> {
 protected:
  void SetUp() override {
    hwy::SetSupportedTargetsForTest(GetParam());
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
  void TearDown() override {
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

TEST_P(UnprojectOnTarget, EqualsThePlainLoop) {
  std::mt19937_64 random(7);
  size_t placed = 0, refused = 0;
  for (size_t n = 0; n < 70; ++n) {
    for (const int depth : {0, 6, kMaxOctreeDepth}) {
      const geometry::Camera camera = test::scene_camera(test::random_eye(random), 640, 400);
      const RowRays rays = row_rays(octree_grid(test::scene_config(depth)), camera, static_cast<int>(random() % 570),
                                    static_cast<int>(random() % 400));
      std::vector<uint32_t> codes(n);
      for (uint32_t& c : codes) {
        const double metres = 0.02 + 1.5 * static_cast<double>(random() % 10000) / 10000;
        c = random() % 5 == 0 ? static_cast<uint32_t>(random() % 3) : image::encode_depth(metres, camera.near_m);
      }
      Row simd(n), plain(n);
      unproject_row(rays, codes.data(), n, simd.keys.data(), {simd.x.data(), simd.y.data(), simd.z.data()});
      unproject_row_scalar(rays, codes.data(), n, plain.keys.data(), {plain.x.data(), plain.y.data(), plain.z.data()});
      ASSERT_EQ(simd.keys, plain.keys);
      for (size_t i = 0; i < n; ++i) {
        ++(plain.keys[i] == kNoCluster ? refused : placed);
        if (plain.keys[i] == kNoCluster) continue;
        ASSERT_EQ(simd.x[i], plain.x[i]);
        ASSERT_EQ(simd.y[i], plain.y[i]);
        ASSERT_EQ(simd.z[i], plain.z[i]);
      }
    }
  }
  EXPECT_GT(placed, 1000u);
  EXPECT_GT(refused, 1000u);
}

INSTANTIATE_TEST_SUITE_P(Every, UnprojectOnTarget, testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& info) { return std::string(hwy::TargetName(info.param)); });

}  // namespace
}  // namespace telesplat::points
