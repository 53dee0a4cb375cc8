// `ellipse` and `ewa` give the same bytes on every instruction set of this machine, for every number of left-over
// lanes, on any number of threads; and they equal plain loops.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <random>

#include "common/geometry/trajectory.h"
#include "common/splat/surfel/kernels.h"
#include "tests/support/splat_scene.h"
#include "tests/support/splat_surfel_plain.h"

namespace telesplat {
namespace {

using testing::Frame;

// Runs the rest of the scope on one instruction set.
class OnTarget {
 public:
  explicit OnTarget(int64_t target) { use(target); }
  ~OnTarget() { use(0); }

 private:
  static void use(int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

const std::vector<int64_t> kTargets = hwy::SupportedAndGeneratedTargets();

struct Plain {
  std::vector<uint32_t> colour;
  std::vector<uint32_t> info;  // kEmptyInfo: no splat
};

Plain plainly(splat::Kernel kernel, const splat::DrawList& list, const geometry::Camera& camera,
              const image::Shading& shading) {
  Plain out;
  const bool ewa = kernel == splat::Kernel::kEwa;
  for (const uint64_t p : ewa ? testing::ewa_plainly(list, camera, shading) : testing::ellipse_plainly(list, camera)) {
    const bool empty = ewa ? splat::pair_info(p) == splat::kEmptyInfo : int64_t(p) == splat::kEmptyKey;
    out.info.push_back(empty ? splat::kEmptyInfo : ewa ? splat::pair_info(p) : splat::key_info(p));
    const uint32_t colour = ewa ? splat::pair_colour(p)
                                : image::Shading::apply(splat::key_albedo(p), shading.table()[splat::key_normal(p)]);
    out.colour.push_back(0xff000000u | (empty ? shading.background() : colour));
  }
  return out;
}

void expect_equal(const Plain& expected, const Frame& actual, const geometry::Camera& camera, const std::string& what) {
  size_t colours = 0, depths = 0;
  for (size_t i = 0; i < expected.colour.size(); ++i) {
    colours += expected.colour[i] != actual.colour[i];
    const bool empty = expected.info[i] == splat::kEmptyInfo;
    if (empty != std::isinf(actual.depth_m[i])) {
      ++depths;
    } else if (!empty) {
      // Depth comes without its bias, which depends on the frame's mean: the key bounds it.
      const float with = splat::decode_depth_code(splat::info_depth_code(expected.info[i]), float(camera.near_m));
      depths += !(actual.depth_m[i] <= with && actual.depth_m[i] >= with * 0.994f);
    }
  }
  EXPECT_EQ(colours, 0u) << what << ": pixels whose colour differs from the plain loop's";
  EXPECT_EQ(depths, 0u) << what << ": pixels whose depth is not the plain loop's";
}

Frame render(splat::Kernel kernel, const splat::DrawList& list, const geometry::Camera& camera,
             const image::Shading& shading, int threads = 1) {
  Frame frame(camera.width, camera.height);
  splat::CpuSplatter(threads).render(list, camera, kernel, shading, frame.target());
  return frame;
}

splat::DrawItem surfel_item(testing::HandMadeItem& made, float radius_m, std::mt19937& rng) {
  splat::DrawItem item = made.item(2.0f);
  item.radius_m = radius_m;
  const auto uniform = [&] { return std::uniform_real_distribution<float>(-1, 1)(rng); };
  item.to_eye = glm::normalize(glm::vec3(uniform(), uniform(), uniform() + 1.5f));
  return item;
}

class SurfelTargets : public ::testing::TestWithParam<splat::Kernel> {};

TEST_P(SurfelTargets, RandomScenesEqualThePlainLoop) {
  geometry::Camera camera = geometry::make_camera(geometry::look_at({0.3, 0.2, 0.4}, {0.1, 0, -1}), 80, 531, 287, 0.05);
  camera.left -= 0.2;
  const image::Shading shading({}, camera);
  for (uint32_t seed = 0; seed < 5; ++seed) {
    std::mt19937 rng(seed);
    auto made = testing::random_items(seed, 60, 300);
    std::vector<splat::DrawItem> items;
    // Sizes from a fraction of a pixel to far beyond the largest splat.
    for (size_t i = 0; i < made.size(); ++i)
      items.push_back(surfel_item(made[i], 0.0005f * std::exp(0.09f * float(i)), rng));
    const auto list = testing::draw_list(std::move(items));
    const Plain expected = plainly(GetParam(), list, camera, shading);
    ASSERT_NE(std::count_if(expected.info.begin(), expected.info.end(),
                            [](uint32_t info) { return info != splat::kEmptyInfo; }),
              0);
    for (int64_t target : kTargets) {
      const OnTarget on(target);
      expect_equal(expected, render(GetParam(), list, camera, shading), camera, hwy::TargetName(target));
    }
  }
}

TEST_P(SurfelTargets, EveryTailLength) {
  const geometry::Camera camera = testing::front_camera(320, 200);
  const image::Shading shading({}, camera);
  for (int size : {1, 3, 9})
    for (int n = 0; n <= 40; ++n) {
      // One item across a tile's border, one within a tile, one across the near plane, and a second of the same
      // cluster.
      std::mt19937 rng(static_cast<uint32_t>(n));
      std::vector<testing::HandMadeItem> made;
      made.emplace_back(geometry::Box{{0.3f, -0.2f, -1.5f}, {1.1f, 0.4f, -1.0f}});
      made.emplace_back(geometry::Box{{-0.3f, 0.1f, -1.0f}, {-0.2f, 0.2f, -0.9f}});
      made.emplace_back(geometry::Box{{-0.5f, -0.5f, -0.6f}, {0.5f, 0.5f, 0.4f}});
      std::vector<splat::DrawItem> items;
      for (auto& m : made) {
        for (int i = 0; i < n; ++i)
          m.add(uint16_t(rng()), uint16_t(rng()), uint16_t(rng()), rng() & 0xffffff, i == 0 ? 0xffff : uint16_t(rng()));
        items.push_back(surfel_item(m, 0.003f * float(size), rng));
        items.push_back(items.back());
        items.back().level.count = std::min(items.back().level.count, 3u);
        items.back().radius_m *= 2;
      }
      const auto list = testing::draw_list(std::move(items));
      const Plain expected = plainly(GetParam(), list, camera, shading);
      for (int64_t target : kTargets) {
        const OnTarget on(target);
        expect_equal(expected, render(GetParam(), list, camera, shading), camera,
                     std::string(hwy::TargetName(target)) + ", " + std::to_string(n) + " points of size " +
                         std::to_string(size));
      }
    }
}

TEST_P(SurfelTargets, ThreadsAndReuseDoNotChangeThePicture) {
  const geometry::Camera camera = testing::front_camera(700, 500), small = testing::front_camera(90, 33);
  const image::Shading shading({}, camera);
  std::mt19937 rng(5);
  auto made = testing::random_items(99, 80, 2000);
  std::vector<splat::DrawItem> items, large;
  for (auto& m : made) items.push_back(surfel_item(m, 0.003f, rng)), large.push_back(surfel_item(m, 0.05f, rng));
  const auto list = testing::draw_list(items);
  const Plain expected = plainly(GetParam(), list, camera, shading);
  for (int threads : {1, 3, 8})
    expect_equal(expected, render(GetParam(), list, camera, shading, threads), camera, std::to_string(threads));

  // One splatter, with frames of other sizes, splats and kernels in between.
  splat::CpuSplatter splatter(2);
  Frame frame(700, 500), other(90, 33);
  for (const splat::Kernel between : splat::kKernels) {
    splatter.render(testing::draw_list(large), small, between, image::Shading({}, small), other.target());
    splatter.render(list, camera, GetParam(), shading, frame.target());
    expect_equal(expected, frame, camera, "reused");
  }
}

// More splats in a tile than ewa keeps between its passes.
TEST_P(SurfelTargets, CrowdedTileEqualsThePlainLoop) {
  const geometry::Camera camera = testing::front_camera(90, 60);
  const image::Shading shading({}, camera);
  std::mt19937 rng(11);
  testing::HandMadeItem made(geometry::Box{{-0.15f, -0.1f, -1.2f}, {0.15f, 0.1f, -0.9f}});
  for (size_t i = 0; i < splat::EwaBuffer::kRecordSplats + 5000; ++i)
    made.add(uint16_t(rng()), uint16_t(rng()), uint16_t(rng()), rng() & 0xffffff, uint16_t(rng()));
  const auto list = testing::draw_list({surfel_item(made, 0.01f, rng)});
  const Plain expected = plainly(GetParam(), list, camera, shading);
  for (int64_t target : kTargets) {
    const OnTarget on(target);
    Frame frame(camera.width, camera.height);
    const auto stats = splat::CpuSplatter(1).render(list, camera, GetParam(), shading, frame.target());
    ASSERT_GT(stats.points_drawn, splat::EwaBuffer::kRecordSplats);
    expect_equal(expected, frame, camera, hwy::TargetName(target));
  }
}

TEST(SurfelCoverage, EwaCoversWhatEllipsesCover) {
  const geometry::Camera camera = testing::front_camera(400, 300);
  const image::Shading shading({}, camera);
  for (uint32_t seed = 0; seed < 4; ++seed) {
    std::mt19937 rng(seed);
    auto made = testing::random_items(seed, 40, 400);
    std::vector<splat::DrawItem> items;
    for (size_t i = 0; i < made.size(); ++i)
      items.push_back(surfel_item(made[i], 0.0005f * std::exp(0.1f * float(i)), rng));
    const auto list = testing::draw_list(std::move(items));
    const Frame ellipse = render(splat::Kernel::kEllipse, list, camera, shading),
                ewa = render(splat::Kernel::kEwa, list, camera, shading);
    size_t covered = 0, different = 0;
    for (size_t i = 0; i < ewa.depth_m.size(); ++i) {
      covered += std::isfinite(ellipse.depth_m[i]);
      different += std::isfinite(ellipse.depth_m[i]) != std::isfinite(ewa.depth_m[i]);
    }
    EXPECT_GT(covered, 1000u);
    EXPECT_EQ(different, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, SurfelTargets, ::testing::Values(splat::Kernel::kEllipse, splat::Kernel::kEwa),
                         [](const auto& info) { return std::string(splat::kernel_name(info.param)); });

}  // namespace
}  // namespace telesplat
