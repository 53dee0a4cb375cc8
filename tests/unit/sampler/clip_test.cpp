// Samplers of a clipped scene show no part that was cut away, and all that lay behind it.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "common/geometry/trajectory.h"
#include "common/volume/warp/warper.h"
#include "services/sampler/julia/sampler.h"
#include "services/sampler/mesh/sampler.h"
#include "services/sampler/volume/raycaster.h"
#include "services/sampler/volume/shear/splatter.h"
#include "tests/support/julia/plain.h"
#include "tests/support/mesh_chunks.h"
#include "tests/support/volume/scenes.h"

namespace telesplat::sampler {
namespace {

using geometry::Camera;
using geometry::Clip;
using image::DepthImage;

Camera camera_from(const glm::dvec3& eye, int width = 200, int height = 130) {
  return geometry::make_camera(geometry::look_at(eye, glm::dvec3(0)), 55, width, height);
}
geometry::Rect whole(const Camera& c) { return {0, 0, c.width, c.height}; }

glm::dvec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

// Planes that leave some of the space about the origin.
Clip random_clip(std::mt19937& random, double reach) {
  std::uniform_real_distribution<double> any(-reach, 0.3 * reach);
  Clip out;
  for (unsigned n = 1 + random() % 3; n > 0; --n) out.planes.push_back({random_direction(random), any(random)});
  return out;
}

std::unique_ptr<Sampler> mesh_sampler(std::unique_ptr<Sampler> sampler) {
  for (auto& [id, chunk] : test::terrain(60, 30)) EXPECT_TRUE(sampler->add_chunk(id, chunk));
  return sampler;
}

glm::dvec3 position(const Camera& c, const DepthImage& image, int x, int y) {
  const size_t at = size_t(y) * size_t(image.width) + size_t(x);
  return c.unproject(x + 0.5, y + 0.5, image::decode_depth(image.depth[at], c.near_m));
}

struct Seen {
  int covered = 0, same = 0, behind = 0, opened = 0;
  int odd = 0;  // pixels at edges of triangles, which a rasteriser that clips may decide in another way
};
// Checks a clipped image: no pixel lies on the far side; where the whole scene's surface is kept, the image shows it;
// where it was cut away, the image shows only surfaces behind it.
Seen compare(const Camera& c, const Clip& clip, const DepthImage& all, const DepthImage& clipped, double tolerance_m) {
  Seen out;
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      const size_t at = size_t(y) * size_t(c.width) + size_t(x);
      const bool was = all.depth[at] != 0, is = clipped.depth[at] != 0;
      if (is) {
        ++out.covered;
        EXPECT_TRUE(clip.keeps(position(c, clipped, x, y), tolerance_m)) << x << "," << y;
        out.odd += !was;  // a clip adds no surface
      }
      if (!was) continue;
      const glm::dvec3 p = position(c, all, x, y);
      if (clip.keeps(p, -tolerance_m)) {
        ++out.same;
        out.odd += clipped.depth[at] != all.depth[at];
      } else if (!clip.keeps(p, tolerance_m)) {
        ++out.opened;
        out.behind += is;
        out.odd += is && clipped.depth[at] >= all.depth[at];  // nearer codes are larger
      }
    }
  return out;
}

class OfMeshes : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    auto made = make_sampler(GetParam(), 1);
    if (!made) GTEST_SKIP() << made.error().text;
    sampler = mesh_sampler(std::move(*made));
  }
  std::unique_ptr<Sampler> sampler;
};

TEST_P(OfMeshes, AClipShowsWhatLayBehindIt) {
  std::mt19937 random(3);
  Seen sum;
  for (int i = 0; i < 12; ++i) {
    glm::dvec3 eye = random_direction(random) * 0.75;
    eye.y = 0.1 + std::abs(eye.y) * 0.3;  // low enough that hills hide each other
    const Camera c = camera_from(eye);
    const Clip clip = random_clip(random, 0.25);
    sampler->set_clip({});
    const DepthImage all = sampler->sample(c, whole(c));
    sampler->set_clip(clip);
    const DepthImage clipped = sampler->sample(c, whole(c));
    const Seen seen = compare(c, clip, all, clipped, 2e-5);
    sum.same += seen.same, sum.behind += seen.behind, sum.opened += seen.opened, sum.odd += seen.odd;
    sampler->set_clip({});
    EXPECT_EQ(sampler->sample(c, whole(c)), all) << "off: everything is back";
  }
  EXPECT_GT(sum.same, 10000);
  EXPECT_GT(sum.opened, 10000);
  EXPECT_GT(sum.behind, 500);
  EXPECT_LE(sum.odd, std::string(GetParam()) == "ray" ? 0 : sum.same / 500);
}

// The closed surface of a cube, cut in the middle, shows its inside.
TEST_P(OfMeshes, ACutSolidIsSeenFromInside) {
  auto made = make_sampler(GetParam(), 1);
  ASSERT_TRUE(made);
  std::vector<test::Vertex> v;
  std::vector<uint32_t> t;
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2, u = (axis + 1) % 3, w = (axis + 2) % 3;
    const float at = side % 2 ? 0.2f : -0.2f;
    glm::vec3 n(0);
    n[axis] = at < 0 ? -1.0f : 1.0f;
    const auto first = uint32_t(v.size());
    for (int corner = 0; corner < 4; ++corner) {
      glm::vec3 p(0);
      p[axis] = at, p[u] = corner & 1 ? 0.2f : -0.2f, p[w] = corner & 2 ? 0.2f : -0.2f;
      v.push_back({p, n, side == 4 ? 0xff0000u : 0x00ff00u});
    }
    for (const uint32_t i : {0u, 1u, 3u, 0u, 3u, 2u}) t.push_back(first + i);
  }
  ASSERT_TRUE((*made)->add_chunk({0}, test::chunk_of(v, t)));
  const Camera c = camera_from({0, 0, 1}, 64, 64);
  (*made)->set_clip({{{{0, 0, -1}, 0}}});  // keeps z <= 0
  const DepthImage image = (*made)->sample(c, whole(c));
  const size_t middle = 32 * 64 + 32;
  ASSERT_NE(image.depth[middle], 0u);
  EXPECT_NEAR(image::decode_depth(image.depth[middle], c.near_m), 1.2, 1e-4) << "the back wall";
  EXPECT_EQ(image.colour[middle], 0xff0000u);
  EXPECT_GT(image::decode_normal16(image.normal[middle]).z, 0.9f) << "its side towards the eye";
  // An empty region shows no pixels.
  (*made)->set_clip({{{{0, 0, -1}, 0}, {{0, 0, 1}, 0.01}}});
  const DepthImage none = (*made)->sample(c, whole(c));
  EXPECT_EQ(none, DepthImage(64, 64));
}

INSTANTIATE_TEST_SUITE_P(Samplers, OfMeshes, testing::Values("ray", "raster"));

julia::Parameters lantern() { return julia::presets()[0].parameters; }

TEST(ClipOfJuliaSets, NothingLiesBeyondAndTheKernelsAgree) {
  const julia::Parameters parameters = lantern();
  const auto placement = julia::place(julia::bounds(parameters), 0.8);
  std::mt19937 random(5);
  int covered = 0, cut = 0, added = 0;
  for (int i = 0; i < 8; ++i) {
    const Camera c = camera_from(random_direction(random) * 0.9, 120, 80);
    const Clip clip = random_clip(random, 0.3);
    const JuliaScene all(parameters, placement), clipped(parameters, placement, clip);
    const DepthImage before = JuliaSampler(1).sample(all, c, whole(c), 1);
    const DepthImage after = JuliaSampler(1).sample(clipped, c, whole(c), 1);
    EXPECT_EQ(after, JuliaSampler(1, julia_trace_plainly).sample(clipped, c, whole(c), 1)) << "as the oracle has it";
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        const size_t at = size_t(y) * size_t(c.width) + size_t(x);
        if (after.depth[at] == 0) continue;
        ++covered;
        ASSERT_TRUE(clip.keeps(position(c, after, x, y), 1e-5)) << x << "," << y;
        added += before.depth[at] == 0;
        cut += before.depth[at] != after.depth[at];
      }
  }
  EXPECT_LE(added, covered / 500) << "a clip adds nothing but what a march from elsewhere meets of threads";
  EXPECT_GT(covered, 5000);
  EXPECT_GT(cut, 1000);
}

// Where a plane cuts the set, the sampler shows the cut itself: flat, facing the eye, neither shadowed nor darkened by
// the part that is gone.
TEST(ClipOfJuliaSets, ACutIsAFlatFaceInFullLight) {
  julia::Parameters ball;  // c = 0: the unit ball
  ball.ambient = 1, ball.shadow = 1;
  const auto placement = julia::place(julia::bounds(ball), 0.8);
  const Camera c = camera_from({0, 0, 1}, 65, 65);
  const Clip clip{{{{0, 0, -1}, 0}}};  // z <= 0
  const JuliaScene scene(ball, placement, clip);
  const DepthImage image = JuliaSampler(1).sample(scene, c, whole(c), 1);
  const size_t middle = 32 * 65 + 32;
  ASSERT_NE(image.depth[middle], 0u);
  EXPECT_NEAR(image::decode_depth(image.depth[middle], c.near_m), 1, 1e-3);
  EXPECT_GT(image::decode_normal16(image.normal[middle]).z, 0.99f);
  julia::Parameters unlit = ball;
  unlit.ambient = 0, unlit.shadow = 0;
  const DepthImage bright = JuliaSampler(1).sample(JuliaScene(unlit, placement, clip), c, whole(c), 1);
  EXPECT_EQ(image.colour[middle], bright.colour[middle]);
}

// The splatter with a clip draws the same as without one from the voxels that the clip leaves.
TEST(ClipOfVolumes, IsAsIfTheVoxelsWereNotThere) {
  const auto grid = test::make_grid({33, 29, 31}, 0.5, {1, 1.1, 1.3}, 25, glm::normalize(glm::dvec3(1, 2, 0.5)));
  const test::VolumeScene scene = test::make_scene(grid, test::blobs, test::ramp(0.5));
  const SlabVolume volume(grid, scene.voxels);
  std::mt19937 random(9);
  int drawn = 0;
  for (int i = 0; i < 9; ++i) {
    const Camera c = camera_from(random_direction(random) * 0.95, 90, 90);
    const Clip clip = random_clip(random, 0.15);
    const auto frame = volume::plan_frame(grid, std::span(&c, 1));
    ASSERT_TRUE(frame);
    const auto clipped = ShearSplatter(1).splat(volume, scene.colours, *frame, {0, grid.size[2]}, nullptr, clip);

    volume::Voxels left;
    left.k_begin = 0, left.k_end = grid.size[2];
    left.rows.push_back(0);
    size_t row = 0;
    for (int k = 0; k < grid.size[2]; ++k)
      for (int j = 0; j < grid.size[1]; ++j, ++row) {
        for (uint32_t n = scene.voxels.rows[row]; n < scene.voxels.rows[row + 1]; ++n) {
          if (!clip.keeps(glm::dvec3(grid.index_to_room * glm::dvec4(scene.voxels.i[n], j, k, 1)))) continue;
          left.i.push_back(scene.voxels.i[n]), left.level.push_back(scene.voxels.level[n]);
          left.normal.push_back(scene.voxels.normal[n]);
        }
        left.rows.push_back(uint32_t(left.i.size()));
      }
    const auto plain =
        ShearSplatter(1).splat(SlabVolume(grid, std::move(left)), scene.colours, *frame, {0, grid.size[2]});
    ASSERT_EQ(clipped.size(), plain.size());
    for (size_t n = 0; n < plain.size(); ++n) {
      EXPECT_EQ(clipped[n].rect, plain[n].rect);
      EXPECT_EQ(clipped[n].pixels, plain[n].pixels);
      ++drawn;
    }
  }
  EXPECT_GT(drawn, 20);
}

}  // namespace
}  // namespace telesplat::sampler
