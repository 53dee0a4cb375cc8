// prepare_patch makes mosaics of a tile: its promises, checked against the samples themselves.
#include <gtest/gtest.h>

#include <set>

#include "common/points/point_model.h"
#include "tests/support/points_scenes.h"

namespace telesplat::points {
namespace {

constexpr geometry::Rect kTile{64, 32, 192, 128};

geometry::Camera camera() { return test::scene_camera({0.3, 0.4, 0.6}, 320, 200); }

glm::dvec3 position(const OctreeGrid& grid, ClusterKey key, const Mosaic::Level& level, uint32_t i) {
  const glm::dvec3 cell(key & 1023, key >> 10 & 1023, key >> 20 & 1023), q(level.x[i], level.y[i], level.z[i]);
  return grid.lo + (cell + (q + 0.5) / 65536.0) * grid.leaf_size;
}

// Pixel of the tile's frame that shows a point.
glm::ivec2 pixel_of(const geometry::Camera& c, const glm::dvec3& p) {
  const auto t = c.room_to_pixel();
  const glm::dvec4 h(p, 1);
  return {static_cast<int>(std::floor(glm::dot(t.x, h) / glm::dot(t.w, h))),
          static_cast<int>(std::floor(glm::dot(t.y, h) / glm::dot(t.w, h)))};
}

// A patch of an image of one tile with a single sample at depth z.
PreparedPatch prepare_one(const ModelConfig& config, const geometry::Camera& c, int x, int y, double z) {
  image::DepthImage image(1, 1);
  image.depth[0] = image::encode_depth(z, c.near_m);
  image.colour[0] = 0x123456;
  image.normal[0] = image::encode_normal16({0, 1, 0});
  return prepare_patch(config, {1}, c, {x, y, 1, 1}, image);
}

TEST(PreparePatch, EmptyTileGivesNoMosaics) {
  const PreparedPatch patch = prepare_patch(test::scene_config(), {1}, camera(), {0, 0, 8, 8}, image::DepthImage(8, 8));
  EXPECT_TRUE(patch.mosaics.empty());
  EXPECT_EQ(patch.points, 0u);
  EXPECT_EQ(patch.outside, 0u);
}

TEST(PreparePatch, OnePointIsOnAllLevels) {
  const PreparedPatch patch = prepare_one(test::scene_config(), camera(), 160, 100, 0.7);
  ASSERT_EQ(patch.mosaics.size(), 1u);
  EXPECT_EQ(patch.points, 1u);
  const Mosaic& m = patch.mosaics[0].second;
  for (int l = 0; l < kLevels; ++l) {
    ASSERT_EQ(m.count(l), 1u);
    EXPECT_EQ(m.level(l).colour[0], 0x123456u);
    EXPECT_EQ(m.level(l).normal[0], image::encode_normal16({0, 1, 0}));
  }
  EXPECT_LE(m.bytes(), sizeof(Mosaic) + 32);
}

TEST(PreparePatch, PositionsLieWithinOneStepOfTheSample) {
  for (const int depth : {0, 4, 6, 8}) {
    const ModelConfig config = test::scene_config(depth);
    const OctreeGrid grid = octree_grid(config);
    const image::DepthImage image = test::sample_scene(camera(), kTile);
    const PreparedPatch patch = prepare_patch(config, {1}, camera(), kTile, image);
    EXPECT_EQ(patch.outside, 0u);
    std::set<std::pair<int, int>> seen;
    for (const auto& [key, mosaic] : patch.mosaics) {
      const Mosaic::Level level = mosaic.level(0);
      for (uint32_t i = 0; i < level.count; ++i) {
        const glm::dvec3 p = position(grid, key, level, i);
        const glm::ivec2 pixel = pixel_of(camera(), p);
        const size_t at = static_cast<size_t>(pixel.y - kTile.y) * kTile.width + (pixel.x - kTile.x);
        ASSERT_LT(at, image.pixels());
        const glm::dvec3 sample =
            camera().unproject(pixel.x + 0.5, pixel.y + 0.5, image::decode_depth(image.depth[at], camera().near_m));
        for (int a = 0; a < 3; ++a) ASSERT_LE(std::abs(p[a] - sample[a]), 0.5001 * grid.leaf_size / 65536);
        ASSERT_EQ(level.colour[i], image.colour[at]);
        ASSERT_EQ(level.normal[i], image.normal[at]);
        ASSERT_TRUE(seen.emplace(pixel.x, pixel.y).second) << "a sample was stored twice";
      }
    }
    EXPECT_EQ(seen.size(), patch.points);
    EXPECT_EQ(patch.points, static_cast<uint64_t>(std::count_if(image.depth.begin(), image.depth.end(),
                                                                [](uint32_t d) { return d != 0; })));
  }
}

TEST(PreparePatch, KeysAscendAndLeavesHoldTheirPoints) {
  const ModelConfig config = test::scene_config();
  const PreparedPatch patch = prepare_patch(config, {1}, camera(), kTile, test::sample_scene(camera(), kTile));
  ASSERT_GT(patch.mosaics.size(), 50u);
  for (size_t i = 1; i < patch.mosaics.size(); ++i) EXPECT_LT(patch.mosaics[i - 1].first, patch.mosaics[i].first);
  const geometry::Box cube = octree_cube(config);
  EXPECT_FLOAT_EQ(cube.size().x, 0.8008f);
  EXPECT_LT(cube.lo.y, config.box_room.lo.y);
  for (const auto& [key, mosaic] : patch.mosaics) {
    const geometry::Box leaf = leaf_box(config, key);
    EXPECT_NEAR(leaf.size().x, 0.8008f / 64, 1e-6);
    const glm::vec3 c = mosaic.centroid_room(leaf);
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(c, leaf.lo)) && glm::all(glm::lessThanEqual(c, leaf.hi)));
  }
}

// Moves a sample across the plane between two leaves in steps of a hundredth of a quantum.
TEST(PreparePatch, LeafBoundaryBelongsToTheUpperLeaf) {
  const ModelConfig config = {{glm::vec3(-0.5f), glm::vec3(0.5f)}, 1};
  geometry::Camera c;  // looks along -z; the cube's middle planes are x = 0, y = 0, z = 0
  c.width = c.height = 1, c.left = c.bottom = -0.5, c.right = c.top = 0.5;
  const double quantum = octree_grid(config).leaf_size / 65536;
  std::set<ClusterKey> keys;
  for (int step = -100; step <= 100; ++step) {
    c.pose.position_room = {step * quantum / 100, 0.1, 0.4};
    const PreparedPatch patch = prepare_one(config, c, 0, 0, 0.2);
    ASSERT_EQ(patch.mosaics.size(), 1u);
    const auto& [key, mosaic] = patch.mosaics[0];
    keys.insert(key);
    if (step != 0) {  // at 0 rounding decides
      EXPECT_EQ(key & 1, step > 0 ? 1u : 0u) << step;
      EXPECT_EQ(mosaic.level(0).x[0], step == 100 ? 1 : step > 0 ? 0 : 65535) << step;
    }
  }
  EXPECT_EQ(keys.size(), 2u);
}

TEST(PreparePatch, SamplesOutsideTheCubeAreCountedAndDropped) {
  ModelConfig config = test::scene_config();
  config.box_room.hi.x = config.box_room.hi.z = 0.0f;
  const image::DepthImage image = test::sample_scene(camera(), kTile);
  const PreparedPatch all = prepare_patch(test::scene_config(), {1}, camera(), kTile, image);
  const PreparedPatch part = prepare_patch(config, {1}, camera(), kTile, image);
  EXPECT_GT(part.outside, 0u);
  EXPECT_GT(part.points, 0u);
  EXPECT_EQ(part.points + part.outside, all.points);
}

TEST(PreparePatch, EveryCoveredBlockHasAPointAtItsLevel) {
  const ModelConfig config = test::scene_config(3);
  const OctreeGrid grid = octree_grid(config);
  for (const double fraction : {1.0, 0.3, 0.02}) {
    image::DepthImage image = test::sample_scene(camera(), kTile);
    test::mask_randomly(image, fraction, 3);
    const PreparedPatch patch = prepare_patch(config, {1}, camera(), kTile, image);
    for (int l = 0; l < kLevels; ++l) {
      std::set<std::pair<int, int>> blocks;
      uint64_t points = 0;
      for (const auto& [key, mosaic] : patch.mosaics) {
        const Mosaic::Level level = mosaic.level(l);
        points += level.count;
        for (uint32_t i = 0; i < level.count; ++i) {
          const glm::ivec2 pixel = pixel_of(camera(), position(grid, key, level, i));
          blocks.emplace(pixel.x >> l, pixel.y >> l);
        }
      }
      for (int y = 0; y < kTile.height; ++y) {
        for (int x = 0; x < kTile.width; ++x) {
          if (image.depth[static_cast<size_t>(y) * kTile.width + x] == 0) continue;
          ASSERT_TRUE(blocks.count({(kTile.x + x) >> l, (kTile.y + y) >> l}))
              << "level " << l << " at " << x << "," << y;
        }
      }
      // Hardly more points than blocks: a block has several points only where leaves or surfaces meet.
      EXPECT_LT(static_cast<double>(points), 1.6 * static_cast<double>(blocks.size())) << "level " << l;
    }
  }
}

TEST(PreparePatch, ConeHoldsAllNormalsAndIsNarrowOnAPlane) {
  const ModelConfig config = test::scene_config();
  const PreparedPatch patch = prepare_patch(config, {1}, camera(), kTile, test::sample_scene(camera(), kTile));
  int narrow = 0;
  for (const auto& [key, mosaic] : patch.mosaics) {
    const Mosaic::Level level = mosaic.level(0);
    float least = 1;
    for (uint32_t i = 0; i < level.count; ++i) {
      const float cosine = glm::dot(image::decode_normal16(level.normal[i]), mosaic.cone_axis());
      least = std::min(least, cosine);
      ASSERT_GE(cosine, mosaic.cone_cosine());
    }
    if (mosaic.cone_cosine() > -1) {
      EXPECT_LT(least - mosaic.cone_cosine(), 2.2f / 127) << "needlessly wide";
    }
    narrow += mosaic.cone_cosine() > 0.97f;
  }
  EXPECT_GT(narrow, 10);
}

TEST(PreparePatch, OpposedNormalsGiveNoCone) {
  image::DepthImage image(2, 1);
  const uint32_t code = image::encode_depth(0.7, camera().near_m);
  image.depth = {code, code};
  image.normal = {image::encode_normal16({0, 1, 0}), image::encode_normal16({0, -1, 0})};
  const PreparedPatch patch = prepare_patch(test::scene_config(0), {1}, camera(), {160, 100, 2, 1}, image);
  ASSERT_EQ(patch.mosaics.size(), 1u);
  EXPECT_EQ(patch.mosaics[0].second.cone_cosine(), -1.0f);
}

TEST(PreparePatch, CentroidIsTheMeanAndPixelRangeTheProjectedLeaf) {
  const ModelConfig config = test::scene_config();
  const OctreeGrid grid = octree_grid(config);
  const PreparedPatch patch = prepare_patch(config, {1}, camera(), kTile, test::sample_scene(camera(), kTile));
  const auto t = camera().room_to_pixel();
  for (const auto& [key, mosaic] : patch.mosaics) {
    const geometry::Box leaf = leaf_box(config, key);
    const Mosaic::Level level = mosaic.level(0);
    glm::dvec3 mean(0);
    for (uint32_t i = 0; i < level.count; ++i) mean += position(grid, key, level, i) / static_cast<double>(level.count);
    const glm::dvec3 off = glm::abs(glm::dvec3(mosaic.centroid_room(leaf)) - mean);
    ASSERT_LT(std::max({off.x, off.y, off.z}), 0.51 * grid.leaf_size / 256);
    const double depth = glm::dot(t.w, glm::dvec4(leaf.centre(), 1));
    ASSERT_NEAR(mosaic.pixel_range(), grid.leaf_size * camera().focal_x() / depth, 1e-3);
  }
}

TEST(PreparePatch, PixelRangeStaysFiniteAroundTheEye) {
  const geometry::Camera c = camera();
  for (const double ahead : {-1.0, 0.0, 0.001, 0.1}) {
    const glm::dvec3 centre = c.pose.position_room + c.pose.orientation * glm::dvec3(0, 0, -ahead);
    const float range = pixel_range(c, centre, 0.01);
    EXPECT_GT(range, 0.0f);
    EXPECT_LE(range, 2 * c.focal_x() * 1.0001);
  }
}

TEST(PreparePatch, CoarseColoursAreMeansAndStayOnTheirSideOfAnEdge) {
  // The left half is near and red, the right half far and blue; the edge runs through the middle of 2x2 blocks.
  image::DepthImage image(8, 8);
  const geometry::Camera c = camera();
  for (int i = 0; i < 64; ++i) {
    const bool left = i % 8 < 3;
    image.depth[i] = image::encode_depth(left ? 0.65 : 0.8, c.near_m);
    image.colour[i] = left ? (i % 2 ? 0xff0000 : 0xfd0000) : 0x0000ff;
  }
  const PreparedPatch patch = prepare_patch(test::scene_config(0), {1}, c, {160, 100, 8, 8}, image);
  ASSERT_EQ(patch.mosaics.size(), 1u);
  for (int l = 0; l < kLevels; ++l) {
    const Mosaic::Level level = patch.mosaics[0].second.level(l);
    std::set<uint32_t> colours;
    for (uint32_t i = 0; i < level.count; ++i) colours.insert(level.colour[i]);
    for (const uint32_t colour : colours)
      EXPECT_TRUE(colour == 0xff || (colour >= 0xfd0000 && (colour & 0xffff) == 0)) << std::hex << colour;
    // The blocks across the edge have a point on each side.
    constexpr uint32_t kExpected[kLevels] = {64, 16 + 4, 4 + 2};
    EXPECT_EQ(level.count, kExpected[l]);
    EXPECT_TRUE(l != 1 || colours.count(0xfe0000)) << "the mean of 0xfd0000 and 0xff0000";
  }
}

TEST(PreparePatch, TilesOfAFrameMayBePreparedInAnyCutAndGiveTheSamePoints) {
  // Cut at multiples of 4 pixels, the tiles have at every level the same points as the whole frame.
  const ModelConfig config = test::scene_config();
  const auto points_of = [&](const std::vector<geometry::Rect>& cut, int l) {
    std::multiset<std::array<uint64_t, 2>> out;
    for (const geometry::Rect& rect : cut)
      for (const auto& [key, m] :
           prepare_patch(config, {1}, camera(), rect, test::sample_scene(camera(), rect)).mosaics)
        for (uint32_t i = 0; i < m.count(l); ++i) {
          const Mosaic::Level v = m.level(l);
          out.insert(
              {uint64_t{key} << 32 | v.colour[i], uint64_t{v.x[i]} | uint64_t{v.y[i]} << 16 | uint64_t{v.z[i]} << 32});
        }
    return out;
  };
  const geometry::Rect left{64, 32, 52, 128}, right{116, 32, 140, 128};
  for (int l = 0; l < kLevels; ++l) EXPECT_EQ(points_of({kTile}, l), points_of({left, right}, l)) << "level " << l;
}

}  // namespace
}  // namespace telesplat::points
