// Content of the model in a view, and its gaps: planes, holes, steps; tiles and masks.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/codec/mask_stream.h"
#include "common/wire/serial.h"
#include "services/packer/points/plan/planned_frame.h"
#include "services/packer/points/plan/planner.h"
#include "services/packer/points/plan/view/view_map.h"
#include "tests/support/files/own_folder.h"
#include "tests/support/points_scenes.h"

namespace telesplat::packer {
namespace {

constexpr int kWidth = 320, kHeight = 192;

// Looks along -z from 1 m before the origin.
geometry::Camera front(int width = kWidth, int height = kHeight) {
  return geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 30, width, height);
}

// A plane z = const sampled by `camera`, only where keep(x, y) is true; metres.
template <class Keep>
image::DepthImage plane(const geometry::Camera& camera, double z, uint32_t colour, Keep keep) {
  image::DepthImage out(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double depth = camera.pose.position_room.z - z;
      const glm::dvec3 p = camera.unproject(x + 0.5, y + 0.5, depth);
      if (!keep(p.x, p.y)) continue;
      const size_t i = size_t(y) * camera.width + x;
      out.depth[i] = image::encode_depth(depth, camera.near_m);
      out.colour[i] = colour;
      out.normal[i] = image::encode_normal16({0, 0, 1});
    }
  return out;
}
bool everywhere(double, double) { return true; }

class ViewMapTest : public testing::Test {
 protected:
  void add(const geometry::Camera& camera, const image::DepthImage& image) {
    ++sequence;
    model.insert(points::prepare_patch(model.config(), {sequence}, camera, {0, 0, camera.width, camera.height}, image,
                                       FrameId{sequence}));
  }
  const ViewMap& look(const geometry::Camera& camera, float nearest = 0.6f) {
    render_view_map(model, camera, {0.005f, nearest}, keys, map);
    return map;
  }
  // Counts without the outermost pixels, which the view that sampled the plane may not have seen.
  size_t inner(const image::PixelMask& mask, int border = 4) const {
    return cropped(mask, {border, border, mask.width() - 2 * border, mask.height() - 2 * border}).count();
  }
  static constexpr size_t kInner = size_t(kWidth - 8) * (kHeight - 8);

  points::PointModel model{test::scene_config()};
  splat::ViewKeys keys{2};
  ViewMap map;
  uint64_t sequence = 0;
};

TEST_F(ViewMapTest, AnEmptyModelShowsNothing) {
  look(front());
  EXPECT_EQ(map.covered.count(), 0u);
  EXPECT_EQ(map.edge.count(), 0u);
  EXPECT_TRUE(std::all_of(map.depth_m.begin(), map.depth_m.end(), [](float d) { return std::isinf(d); }));
}

TEST_F(ViewMapTest, APlaneSampledAtTheViewsRateLacksNothing) {
  add(front(), plane(front(), 0, 0x336699, everywhere));
  look(front());
  EXPECT_EQ(map.covered.count(), size_t(kWidth) * kHeight);
  EXPECT_EQ(inner(map.lacking), 0u);
  EXPECT_EQ(inner(map.edge), 0u);
  for (size_t i = 0; i < map.depth_m.size(); ++i) {
    ASSERT_NEAR(map.depth_m[i], 1.0f, 2e-3f);
    ASSERT_EQ(map.colour[i], 0x336699u);
    ASSERT_EQ(map.normal[i], image::encode_normal16({0, 0, 1}));
  }
}

TEST_F(ViewMapTest, APlaneSampledAtHalfTheRateIsSparse) {
  const geometry::Camera coarse = front(kWidth / 2, kHeight / 2);
  add(coarse, plane(coarse, 0, 0x336699, everywhere));
  look(front());
  EXPECT_EQ(inner(map.covered), kInner) << "splats hide what is behind them";
  EXPECT_GT(inner(map.lacking), kInner * 6 / 10) << "a sample for four pixels";
  EXPECT_LT(inner(map.lacking), kInner * 8 / 10);
}

TEST_F(ViewMapTest, ASparsePlaneBeforeADenseOneIsNotGood) {
  const geometry::Camera coarse = front(kWidth / 3, kHeight / 3);
  add(front(), plane(front(), -0.2, 0xff0000, everywhere));
  look(front());
  ASSERT_EQ(inner(map.lacking), 0u);
  add(coarse, plane(coarse, 0.1, 0x00ff00, everywhere));
  look(front());
  EXPECT_GT(inner(map.lacking), kInner * 7 / 10);
  for (int y = 4; y < kHeight - 4; ++y)
    for (int x = 4; x < kWidth - 4; ++x) {
      const size_t i = size_t(y) * kWidth + x;
      ASSERT_TRUE(map.colour[i] == 0x00ff00u || map.lacking.at(x, y))
          << "the far plane shows through and is taken for good";
    }
}

TEST_F(ViewMapTest, AHoleIsNothingAndItsRimAnEdge) {
  add(front(), plane(front(), 0, 0x808080, [](double x, double y) { return x * x + y * y > 0.0025; }));
  look(front());
  size_t open = 0, rim = 0;
  for (int y = 4; y < kHeight - 4; ++y)
    for (int x = 4; x < kWidth - 4; ++x) {
      const glm::dvec3 p = front().unproject(x + 0.5, y + 0.5, 1.0);
      const double r = std::hypot(p.x, p.y), pixel = 1.0 / front().focal_x();
      open += !map.covered.at(x, y);
      rim += map.edge.at(x, y);
      if (r < 0.05 - 2 * pixel) {
        ASSERT_FALSE(map.covered.at(x, y));
      }
      if (r > 0.05 + 3 * pixel) {
        ASSERT_FALSE(map.edge.at(x, y)) << x << " " << y;
      }
    }
  EXPECT_GT(open, 1000u);
  EXPECT_GT(rim, 100u);
}

TEST_F(ViewMapTest, AStepOfDepthIsAnEdge) {
  add(front(), plane(front(), -0.2, 0x808080, [](double x, double) { return x < 0; }));
  add(front(), plane(front(), 0.1, 0x808080, [](double x, double) { return x >= 0; }));
  look(front());
  for (int y = 8; y < kHeight - 8; ++y) {
    int edges = 0;
    for (int x = 8; x < kWidth - 8; ++x) {
      edges += map.edge.at(x, y);
      if (map.edge.at(x, y)) {
        ASSERT_LT(std::abs(x + 0.5 - kWidth / 2), 3) << y;
      }
    }
    ASSERT_GE(edges, 2) << y;
  }
}

TEST_F(ViewMapTest, SlopesHaveNoEdgesAndCreasesHave) {
  // A roof: depth falls by more than a step's share from pixel to pixel, its normals meet at a right angle.
  const geometry::Camera camera = geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 30, 40, 24);
  image::DepthImage roof(40, 24);
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 40; ++x) {
      const size_t i = size_t(y) * 40 + x;
      const double depth = 1.0 / (1.0 - 0.012 * std::abs(x + 0.5 - 20));
      roof.depth[i] = image::encode_depth(depth, camera.near_m);
      roof.colour[i] = 0x808080;
      roof.normal[i] = image::encode_normal16({x < 20 ? -0.7f : 0.7f, 0, 0.7f});
    }
  model = points::PointModel({{{-2, -2, -2}, {2, 2, 2}}, 5});
  add(camera, roof);
  look(camera);
  for (int y = 3; y < 21; ++y) {
    EXPECT_TRUE(map.edge.at(19, y) && map.edge.at(20, y)) << y;
    for (int x = 3; x < 37; ++x) {
      if (std::abs(x - 19.5) > 2) {
        ASSERT_FALSE(map.edge.at(x, y)) << x << " " << y;
      }
    }
  }
}

TEST_F(ViewMapTest, FarSamplesAreGoodEnoughWhereLessIsAskedFor) {
  const geometry::Camera coarse = front(kWidth / 2, kHeight / 2);
  add(coarse, plane(coarse, 0, 0x336699, everywhere));
  look(front(), 1.5f);
  EXPECT_LT(inner(map.lacking), kInner / 100);
}

// One thread and several, whole and tile by tile give the same.
TEST_F(ViewMapTest, TilesAreJudgedAloneAsInTheWhole) {
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 300, 200);
  add(camera, test::sample_scene(camera, {0, 0, 300, 200}));
  const geometry::Camera view = test::scene_camera({0.55, 0.35, 0.25}, 333, 217);
  look(view);
  splat::ViewKeys one(1);
  one.begin(model, view, 64, 32);
  const PixelJudge judge(view, {0.005f, 0.6f}, one.rim());
  size_t differing = 0;
  one.draw_all([&](const splat::ViewKeys::Tile& tile) {
    ViewMap part;
    reset_masks(tile.rect.width, tile.rect.height, part);
    judge.judge(tile, 0, 0, part);
    differing += !(part.covered == cropped(map.covered, tile.rect)) +
                 !(part.lacking == cropped(map.lacking, tile.rect)) + !(part.edge == cropped(map.edge, tile.rect)) +
                 !(part.weak == cropped(map.weak, tile.rect)) + !(part.strong == cropped(map.strong, tile.rect));
  });
  EXPECT_EQ(differing, 0u);
}

image::PixelMask random_mask(int width, int height, double share, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  image::PixelMask mask(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (uniform(random) < share) mask.set(x, y);
  return mask;
}

TEST(RayTiles, HoldEveryRayOnce) {
  for (const auto& [width, height, share, limits] : {std::tuple{333, 217, 0.01, TileLimits{64, 0}},
                                                     {333, 217, 0.3, TileLimits{128, 500}},
                                                     {65, 1, 1.0, TileLimits{32, 1}},
                                                     {640, 400, 0.0005, TileLimits{256, 0}},
                                                     {100, 100, 1.0, TileLimits{4096, 0}}}) {
    const image::PixelMask mask = random_mask(width, height, share, 3);
    image::PixelMask sum(width, height);
    uint64_t rays = 0;
    for (const RayTile& t : cut_tiles(mask, {0, 0, width, height}, limits)) {
      EXPECT_EQ(t.mask.count(), t.rays);
      EXPECT_GE(t.rays, 1u);
      EXPECT_TRUE(geometry::contains({0, 0, width, height}, t.rect));
      EXPECT_LE(std::max(t.rect.width, t.rect.height), limits.size);
      if (limits.rays > 0) {
        EXPECT_TRUE(t.rays <= limits.rays || std::max(t.rect.width, t.rect.height) <= kLeastTile);
      }
      merge(t.mask, t.rect.x, t.rect.y, sum);
      rays += t.rays;
    }
    EXPECT_EQ(sum, mask);
    EXPECT_EQ(rays, mask.count());
  }
}

// A view of few rays is one tile of any size; more rays are shared out evenly, so that there are few tiles.
TEST(RayTiles, AreFewAndHaveAboutAsManyRaysEach) {
  const image::PixelMask few = random_mask(1312, 816, 0.003, 5);
  EXPECT_EQ(cut_tiles(few, {0, 0, 1312, 816}, {2048, few.count()}).size(), 1u);
  EXPECT_EQ(cut_tiles(few, {0, 0, 1312, 816}, {1024, few.count()}).size(), 2u);

  // Half of the rays lie in a corner.
  image::PixelMask many = random_mask(1312, 816, 0.01, 6);
  merge(random_mask(200, 150, 0.35, 7), 1100, 20, many);
  constexpr uint64_t kMost = 2000;
  const std::vector<RayTile> tiles = cut_tiles(many, {0, 0, 1312, 816}, {2048, kMost});
  const uint64_t least = (many.count() + kMost - 1) / kMost;
  EXPECT_GE(tiles.size(), least);
  EXPECT_LE(tiles.size(), least + least / 2) << many.count();
  for (const RayTile& t : tiles) EXPECT_GT(t.rays, kMost / 4);
}

TEST(RayTiles, ArePlansThatTheWireTakes) {
  const image::PixelMask mask = random_mask(300, 200, 0.2, 7);
  wire::Plan plan;
  plan.camera = front(300, 200);
  std::vector<RayTile> tiles = cut_tiles(mask, {0, 0, 300, 200}, {64, 0});
  sort_by_distance_to_centre(tiles, 300, 200);
  EXPECT_EQ(add_tiles(tiles, 2, plan), tiles.size());
  const std::string message = wire::encode(plan);
  const auto decoded = wire::decode<wire::Plan>(std::as_bytes(std::span(message)));
  EXPECT_TRUE(decoded.ok());
  const RayTile& first = tiles.front();
  EXPECT_LE(std::abs(first.rect.x + first.rect.width / 2 - 150), 64);
  size_t word = 0;
  for (size_t i = 0; i < tiles.size(); ++i) {
    const uint32_t words = plan.masks.empty() ? 0 : plan.tiles[i * wire::kPlanNumbers + 5];
    const auto back =
        codec::decode_mask(std::span(plan.masks).subspan(word, words), tiles[i].rect.width, tiles[i].rect.height);
    ASSERT_TRUE(back.ok());
    EXPECT_EQ(*back, tiles[i].mask);
    word += words;
  }
}

}  // namespace
}  // namespace telesplat::packer
