#include <gtest/gtest.h>

#include <random>

#include "common/volume/lighting.h"
#include "services/sampler/volume/raycaster.h"
#include "services/sampler/volume/shear/rows.h"
#include "services/sampler/volume/shear/splatter.h"
#include "tests/support/volume/oracle.h"
#include "tests/support/volume/scenes.h"

namespace telesplat::sampler {
namespace {

using test::VolumeScene;

// A camera that looks along `axis`, from its lower end or its upper one, a little aside.
geometry::Camera from_axis(int axis, int sign, double distance_m, int side) {
  glm::dvec3 eye(0.21, 0.13, -0.17);
  eye[axis] = sign;
  return geometry::make_camera(geometry::look_at(glm::normalize(eye) * distance_m, glm::dvec3(0)), 45, side, side);
}

// Largest difference from the oracle in any channel of any layer, in 1/255, where no voxel is hidden.
double worst_difference(const VolumeScene& scene, const volume::ShearFrame& frame,
                        const std::vector<volume::SliceImage>& images, int planes = 1) {
  test::SplatOracle oracle(scene, frame, planes);
  double worst = 0;
  for (size_t l = 0; l < frame.layers.size(); ++l) {
    const volume::SliceImage* image = nullptr;
    for (const auto& i : images)
      if (i.layer == int(l)) image = &i;
    for (int y = 0; y < frame.height; ++y)
      for (int x = 0; x < frame.width; ++x) {
        const glm::dvec4 expected = oracle.pixel(frame.layers[l], x, y);
        const glm::dvec4 got = image ? test::look_up(*image, x + 0.5, y + 0.5) : glm::dvec4(0);
        for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(expected[c] - got[c]) * 255);
      }
  }
  return worst;
}

TEST(ShearSplatter, EqualsTheOracleAlongAllAxes) {
  const auto grid = test::make_grid({23, 31, 19}, 0.5, {1, 1.2, 1.7}, 20, glm::normalize(glm::dvec3(1, 2, 0.5)));
  int twice = 0;
  for (const bool lit : {false, true}) {
    // Where levels are opaque, planes between slices count too; these levels are so transparent that they hide nothing.
    const VolumeScene scene = test::make_scene(grid, test::blobs, test::ramp(lit ? 0.5 : 0.15), lit);
    const SlabVolume volume(grid, scene.voxels);
    for (int axis = 0; axis < 3; ++axis)
      for (const int sign : {-1, 1}) {
        const auto camera = from_axis(axis, sign, 0.9, 120);
        const auto frame = volume::plan_frame(grid, std::span(&camera, 1));
        ASSERT_TRUE(frame);
        const auto images = ShearSplatter(1).splat(volume, scene.colours, *frame, {0, grid.size[2]});
        ASSERT_FALSE(images.empty());
        const double most =
            -std::log(1 - (lit ? 0.5 : 0.15)) * frame->path(grid, frame->width / 2.0, frame->height / 2.0);
        const int planes = most > 0.6 ? 2 : 1;
        twice += planes == 2;
        EXPECT_LT(worst_difference(scene, *frame, images, planes), 1) << "axis " << axis << ", from " << sign;
      }
  }
  EXPECT_TRUE(twice > 0 && twice < 12) << twice;  // both ways were tried
}

TEST(ShearSplatter, EqualsTheOracleAtAnySizeOfPixels) {
  const auto grid = test::make_grid({40, 40, 40}, 0.5);
  const VolumeScene scene = test::make_scene(grid, test::blobs, test::ramp(0.2));
  const SlabVolume volume(grid, scene.voxels);
  const auto camera = from_axis(2, 1, 1.1, 100);
  auto frame = volume::plan_frame(grid, std::span(&camera, 1));
  ASSERT_TRUE(frame);
  const double width = frame->width * frame->du, height = frame->height * frame->dv;
  // From 4 pixels a voxel to 12 voxels a pixel, different across and down; also wider than a tile.
  for (const auto& [w, h] : {std::pair{160, 40}, {41, 130}, {23, 9}, {9, 11}, {1, 1}, {700, 10}}) {
    frame->width = w, frame->height = h;
    frame->du = width / w, frame->dv = height / h;
    const auto images = ShearSplatter(1).splat(volume, scene.colours, *frame, {0, 40});
    EXPECT_LT(worst_difference(scene, *frame, images), 0.75) << w << " x " << h;
  }
}

TEST(ShearSplatter, CropsImagesAndLeavesOutEmptyOnes) {
  const auto grid = test::make_grid({32, 32, 32}, 0.5);
  const VolumeScene scene = test::make_scene(grid, test::blobs, test::ramp(0.4));
  const SlabVolume volume(grid, scene.voxels);
  const auto camera = from_axis(1, 1, 0.9, 150);
  const auto frame = volume::plan_frame(grid, std::span(&camera, 1));
  ASSERT_TRUE(frame);
  ShearStats stats;
  const auto images = ShearSplatter(1).splat(volume, scene.colours, *frame, {0, 32}, &stats);
  ASSERT_FALSE(images.empty());
  for (const auto& image : images) {
    const auto any = [&](int x, int y, int dx, int dy) {
      for (; x < image.rect.width && y < image.rect.height; x += dx, y += dy)
        if (image.pixels[size_t(y * image.rect.width + x)] != 0) return true;
      return false;
    };
    ASSERT_EQ(image.pixels.size(), size_t(image.rect.width) * size_t(image.rect.height));
    EXPECT_TRUE(any(0, 0, 1, 0) && any(0, image.rect.height - 1, 1, 0));
    EXPECT_TRUE(any(0, 0, 0, 1) && any(image.rect.width - 1, 0, 0, 1));
  }
  EXPECT_EQ(stats.voxels + stats.skipped, scene.voxels.size());
  EXPECT_EQ(stats.voxels, scene.voxels.size());  // all in view, none behind opaque voxels
  EXPECT_GT(stats.pixels, stats.voxels);

  const std::vector<volume::LevelColour> nothing(256);
  EXPECT_TRUE(ShearSplatter(1).splat(volume, nothing, *frame, {0, 32}, &stats).empty());
  EXPECT_EQ(stats.voxels, 0u);
  volume::Voxels none;
  none.k_end = 32;
  none.rows.assign(32 * 32 + 1, 0);
  EXPECT_TRUE(ShearSplatter(1).splat(SlabVolume(grid, none), scene.colours, *frame, {0, 32}, &stats).empty());
}

// A solid block whose inside is skipped. It looks the same as layers splatted one by one, which are hidden by no other
// layer, from the sampled pose and from 5 degrees beside it.
TEST(ShearSplatter, SkipsOnlyWhatNobodySees) {
  const auto grid = test::make_grid({48, 48, 48}, 0.5);
  auto colours = test::ramp(0.9);
  for (auto& c : colours)
    if (c.extinction > 0) c.extinction = 9;
  const VolumeScene scene = test::make_scene(
      grid,
      [](glm::dvec3 p) {
        return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 0.8 ? 0.6 + 0.3 * std::sin(9 * p.x) : 0.0;
      },
      colours);
  const SlabVolume volume(grid, scene.voxels);
  for (int axis = 0; axis < 3; ++axis) {
    const auto camera = from_axis(axis, -1, 1.0, 200);
    const auto frame = volume::plan_frame(grid, std::span(&camera, 1));
    ASSERT_TRUE(frame);
    ShearStats stats;
    const auto images = ShearSplatter(1).splat(volume, scene.colours, *frame, {0, 48}, &stats);
    EXPECT_GT(stats.skipped, stats.voxels);
    std::vector<volume::SliceImage> whole;
    for (size_t l = 0; l < frame->layers.size(); ++l) {
      auto single = *frame;
      single.layers = {frame->layers[l]};
      for (auto& image : ShearSplatter(1).splat(volume, scene.colours, single, {0, 48})) {
        image.layer = int(l);
        whole.push_back(std::move(image));
      }
    }
    for (const double degrees : {0.0, 5.0, -5.0})
      for (const glm::dvec3 up : {glm::dvec3(0, 1, 0), glm::dvec3(1, 0, 0)}) {
        const glm::dmat3 turn(glm::rotate(glm::dmat4(1.0), glm::radians(degrees), up));
        const auto moved =
            geometry::make_camera(geometry::look_at(turn * camera.pose.position_room, glm::dvec3(0)), 45, 200, 200);
        const auto seen = test::warp_plainly(grid, *frame, images, moved, 0x00ffffff);
        const auto expected = test::warp_plainly(grid, *frame, whole, moved, 0x00ffffff);
        int worst = 0, off = 0;
        for (size_t p = 0; p < seen.colour.size(); ++p)
          for (const int shift : {0, 8, 16}) {
            const int d = std::abs(int(seen.colour[p] >> shift & 255) - int(expected.colour[p] >> shift & 255));
            worst = std::max(worst, d), off += d > 3;
          }
        EXPECT_LE(worst, 3) << off << " of axis " << axis << ", " << degrees << " degrees";
      }
  }
}

TEST(ShearRows, HoldEveryVoxelInOrder) {
  const auto grid = test::make_grid({9, 7, 11}, 1);
  std::mt19937 random(3);
  VolumeScene scene = test::make_scene(
      grid, [&](glm::dvec3) { return random() % 3 == 0 ? 0.8 : 0.0; }, test::ramp(0.5));
  const volume::Voxels part = test::part_of(scene, 2, 9);
  for (int axis = 0; axis < 3; ++axis) {
    const ShearRows rows = arrange(grid, part, axis);
    std::vector<std::array<int, 5>> expected, got;
    for (int k = part.k_begin; k < part.k_end; ++k)
      for (int j = 0; j < 7; ++j)
        for (uint32_t n = part.rows[size_t((k - part.k_begin) * 7 + j)];
             n < part.rows[size_t((k - part.k_begin) * 7 + j) + 1]; ++n) {
          const std::array<int, 3> p{part.i[n], j, k};
          expected.push_back(
              {p[size_t(axis)], p[size_t((axis + 2) % 3)], p[size_t((axis + 1) % 3)], part.level[n], part.normal[n]});
        }
    std::sort(expected.begin(), expected.end());
    for (int s = 0; s < rows.slices; ++s)
      for (int v = 0; v < rows.rows; ++v)
        for (uint32_t n = rows.first[size_t(s * rows.rows + v)]; n < rows.first[size_t(s * rows.rows + v) + 1]; ++n) {
          const ShearCell& c = rows.cells[n];
          got.push_back({s + rows.slice_begin, v + rows.row_begin, c.u, c.level, c.normal});
          const auto& b = rows.bounds[size_t(s)];
          EXPECT_TRUE(c.u >= b.u_lo && c.u <= b.u_hi && v + rows.row_begin >= b.v_lo && v + rows.row_begin <= b.v_hi);
        }
    EXPECT_EQ(got, expected) << "axis " << axis;
  }
}

TEST(Lighting, HeadLightShinesFromTheEyeOnTheCentre) {
  const auto grid = test::make_grid({8, 8, 8}, 0.4);
  const auto light = volume::normal_intensities(grid, {0, 0, 2});
  ASSERT_EQ(light.size(), 65536u);
  const auto of = [&](glm::vec3 n) { return light[image::encode_normal16(n)]; };
  EXPECT_GT(of({0, 0, 1}), of({1, 0, 0}) + 0.4f);
  EXPECT_NEAR(of({0, 0, 1}), light[volume::kNoNormal], 0.01);
  for (const float l : light) ASSERT_TRUE(l >= 0 && l <= 1);
  // From the centre itself there is no direction; the light shines all the same.
  EXPECT_GT(volume::normal_intensities(grid, grid.centre_room())[volume::kNoNormal], 0.1f);
}

// A ray through the middle of a uniform block, along an axis, meets n voxels; the outermost ones fall to zero over one
// more voxel.
TEST(VolumeRaycaster, IntegratesAUniformBlock) {
  const auto grid = test::make_grid({17, 17, 17}, 0.17);  // a voxel is a centimetre
  for (const double extinction : {0.01, 0.1, 1.0}) {
    std::vector<volume::LevelColour> colours(256);
    colours[255] = {1, 0.5f, 0.25f, float(extinction)};
    const VolumeScene scene = test::make_scene(
        grid, [](glm::dvec3) { return 1.0; }, colours, false);
    const auto camera = geometry::make_camera(geometry::look_at({0, 0, 1}, {0, 0, 0}), 5, 3, 3);
    const image::View view = VolumeRaycaster(grid, scene.voxels, colours, 1).draw(camera, 0x00000000, 0.05);
    const double alpha = 1 - std::exp(-17 * extinction);
    EXPECT_NEAR(view.colour[4] >> 16 & 255, 255 * alpha, 1);
    EXPECT_NEAR(view.colour[4] >> 8 & 255, 127.5 * alpha, 1);
    EXPECT_NEAR(view.colour[4] & 255, 63.75 * alpha, 1);
    EXPECT_NEAR(view.colour[4] >> 24, 255 * alpha, 1);
    EXPECT_EQ(std::isinf(view.depth_m[4]), alpha < 0.25);
    // Opacity passes a quarter -log(0.75) / 0.1 voxels behind the plane half way up the ramp.
    if (extinction == 0.1) {
      EXPECT_NEAR(view.depth_m[4], 1 - 0.085 - 0.005 + 0.01 * (0.5 - std::log(0.75) / extinction), 0.002);
    }
  }
}

}  // namespace
}  // namespace telesplat::sampler
