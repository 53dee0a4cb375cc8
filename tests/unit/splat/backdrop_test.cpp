// The backdrop shows coarse points in pixels that finer points leave empty, and nowhere else.
#include "common/splat/backdrop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/points/mosaic_builder.h"

namespace telesplat::splat {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
const geometry::Camera kCamera = geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 60, 320, 240);
const points::ModelConfig kModel{{glm::vec3(-0.5f), glm::vec3(0.5f)}, 2, false};

// A square of points at z that faces +z, or -z, from x0 to x1 and -0.3 to 0.3.
points::PointModel square(float z, float x0, float x1, float step, uint32_t colour, bool away = false) {
  points::PointModel model(kModel);
  const points::OctreeGrid grid = points::octree_grid(kModel);
  std::map<points::ClusterKey, std::vector<glm::dvec3>> leaves;
  for (float x = x0; x < x1; x += step)
    for (float y = -0.3f; y < 0.3f; y += step) {
      const glm::dvec3 at = (glm::dvec3(x, y, z) - grid.lo) / grid.leaf_size, leaf = glm::floor(at);
      const auto key = uint32_t(leaf.x) | uint32_t(leaf.y) << 10 | uint32_t(leaf.z) << 20;
      leaves[key].push_back((at - leaf) * 65536.0);
    }
  points::Insertion insertion{{1}, {}};
  for (const auto& [key, places] : leaves) {
    const auto n = uint32_t(places.size());
    points::MosaicBuilder out({1}, {}, {n, n, n});
    for (uint32_t i = 0; i < n; ++i) {
      out.x[i] = uint16_t(places[i].x), out.y[i] = uint16_t(places[i].y), out.z[i] = uint16_t(places[i].z);
      out.normal[i] = image::encode_normal16({0, 0, away ? -1 : 1});
      out.colour[i] = colour;
    }
    auto& change = insertion.changes.emplace_back();
    change.key = key;
    change.added.push_back(out.finish(float(grid.leaf_size) / step, glm::vec3(0)));
  }
  model.commit(std::move(insertion));
  return model;
}

struct Picture {
  std::vector<uint32_t> colour = std::vector<uint32_t>(320 * 240);
  std::vector<float> depth_m = std::vector<float>(320 * 240);
  FrameTarget target() { return {320, 240, colour.data(), depth_m.data()}; }
  // Share of pixels that show something nearer than 9 m.
  double covered() const {
    return double(std::ranges::count_if(depth_m, [](float d) { return d < kNothing; })) / double(depth_m.size());
  }
};

// Draws a model's points with those of another one behind them.
Picture drawn(const points::PointModel& model, const points::PointModel* coarse, RenderOptions options = {}) {
  DrawList list;
  select_view(model, kCamera, {}, list);
  if (coarse) {
    list.coarse = std::make_shared<DrawList>();
    select_coarse(*coarse, kCamera, {}, *list.coarse);
  }
  Picture out;
  image::ShadingParameters unlit;
  unlit.lit = false;
  CpuSplatter(2).render(list, kCamera, options, image::Shading(unlit, kCamera), out.target());
  return out;
}

class BackdropTest : public testing::TestWithParam<Kernel> {
 protected:
  const RenderOptions options{.kernel = GetParam()};
};

TEST_P(BackdropTest, CoarsePointsFillTheEmptyHalf) {
  const auto fine = square(0, -0.3f, 0, 0.002f, 0xff0000), coarse = square(0, -0.3f, 0.3f, 0.02f, 0x0000ff);
  const Picture with = drawn(fine, &coarse, options), without = drawn(fine, nullptr, options);
  size_t filled = 0;
  for (int y = 70; y < 170; ++y)
    for (int x = 80; x < 240; ++x) {
      const size_t at = size_t(320 * y + x);
      EXPECT_LT(with.depth_m[at], kNothing) << x << " " << y;
      EXPECT_NEAR(with.depth_m[at], 1, 0.01);
      if (x < 155) EXPECT_EQ(with.colour[at], without.colour[at]);
      if (x > 165) filled += (with.colour[at] & 0xffffff) == 0x0000ff;
    }
  EXPECT_EQ(filled, 100u * 74u);
}

TEST_P(BackdropTest, FattensASurfaceByHalfASpacingAtMost) {
  const auto fine = square(0, -0.3f, 0.3f, 0.002f, 0xff0000), coarse = square(0, -0.3f, 0.3f, 0.02f, 0x0000ff);
  const double fatter = 0.62 / 0.6;
  EXPECT_LT(drawn(fine, &coarse, options).covered(), fatter * fatter * drawn(fine, nullptr, options).covered());
}

TEST_P(BackdropTest, FarPointsShowBeforeCoarseOnes) {
  // Rays reached the far surface, so the coarse points before it are not known to be there.
  const auto fine = square(-0.3f, -0.4f, 0.4f, 0.002f, 0xff0000), coarse = square(0.2f, -0.3f, 0.3f, 0.02f, 0x0000ff);
  EXPECT_EQ(drawn(fine, &coarse, options).colour[320 * 120 + 160] & 0xffffff, 0xff0000u);
}

INSTANTIATE_TEST_SUITE_P(Kernels, BackdropTest, testing::ValuesIn(kKernels),
                         [](const auto& of) { return std::string(kernel_name(of.param)); });

TEST(Backdrop, SurfacesAreSeenFromBehind) {
  const points::PointModel nothing(kModel);
  const auto coarse = square(0, -0.3f, 0.3f, 0.02f, 0x0000ff, true);
  EXPECT_GT(drawn(nothing, &coarse).covered(), 0.2);
}

TEST(Backdrop, WithoutFinishAPictureIsFilledToo) {
  const points::PointModel nothing(kModel);
  const auto coarse = square(0, -0.3f, 0.3f, 0.02f, 0x0000ff);
  const double covered = drawn(nothing, &coarse).covered();
  EXPECT_NEAR(drawn(nothing, &coarse, {.finish = {false, false, false}}).covered(), covered, 0.02 * covered);
}

TEST(Backdrop, HasFewerPixelsTheFartherApartItsPointsAre) {
  DrawList list;
  select_coarse(square(0, -0.3f, 0.3f, 0.01f, 0), kCamera, {}, list);
  const int fine = list.halvings;
  select_coarse(square(0, -0.3f, 0.3f, 0.1f, 0), kCamera, {}, list);
  EXPECT_EQ(fine, kLeastHalvings);
  EXPECT_EQ(list.halvings, kMostHalvings);
}

}  // namespace
}  // namespace telesplat::splat
