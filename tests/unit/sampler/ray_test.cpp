// The ray sampler on meshes small enough to know every pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "services/sampler/mesh/sampler.h"
#include "tests/support/mesh_chunks.h"

namespace telesplat::sampler {
namespace {

using geometry::Camera;
using geometry::Rect;
using test::Vertex;

const glm::vec3 kUp{0, 0, 1};  // towards the cameras below, which look along -z from the origin

Rect whole(const Camera& c) { return {0, 0, c.width, c.height}; }
Camera camera_8x8() { return geometry::make_camera({}, 90, 8, 8, 0.1); }

// A square of 2 half x 2 half metres at z = -depth, in two triangles.
geometry::ChunkBytes square(float depth, uint32_t colour, glm::vec3 normal = kUp, float half = 1.0f) {
  const auto v = [&](float x, float y) { return Vertex{{x, y, -depth}, normal, colour}; };
  return test::chunk_of({v(-half, -half), v(half, -half), v(half, half), v(-half, half)}, {0, 1, 2, 0, 2, 3});
}

std::unique_ptr<Sampler> sampler_with(geometry::ChunkBytes chunk) {
  auto s = make_ray_sampler(1);
  EXPECT_TRUE(s->add_chunk({0}, std::move(chunk)).ok());
  return s;
}

TEST(RaySampler, EmptySceneGivesEmptyImage) {
  const Camera camera = camera_8x8();
  EXPECT_EQ(make_ray_sampler(2)->sample(camera, whole(camera)), image::DepthImage(8, 8));
}

TEST(RaySampler, TriangleCoversExactlyThePixelsWhoseCentresLieInside) {
  // At depth 1, pixel (x, y) has its centre at u = (x - 3.5) / 4, v = (3.5 - y) / 4. This triangle's corners lie
  // between centres.
  auto s = sampler_with(test::triangle({{-0.51f, -0.51f, -1}, kUp, 0x112233}, {{0.51f, -0.51f, -1}, kUp, 0x112233},
                                       {{-0.51f, 0.51f, -1}, kUp, 0x112233}));
  const Camera camera = camera_8x8();
  const image::DepthImage image = s->sample(camera, whole(camera));
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      const double u = (x - 3.5) / 4, v = (3.5 - y) / 4;
      const bool inside = u > -0.51 && v > -0.51 && u + v < 0;
      if (u + v == 0) continue;  // the hypotenuse runs through these centres
      const size_t at = size_t(y) * 8 + x;
      EXPECT_EQ(image.depth[at], inside ? image::encode_depth(1.0, 0.1) : 0u) << x << "," << y;
      EXPECT_EQ(image.colour[at], inside ? 0x112233u : 0u) << x << "," << y;
      EXPECT_EQ(image.normal[at], inside ? image::encode_normal16(kUp) : 0) << x << "," << y;
    }
}

TEST(RaySampler, DepthIsAlongTheViewAxisAndNotAlongTheRay) {
  auto s = sampler_with(square(2, 0xffffff, kUp, 4));
  const Camera camera = camera_8x8();
  const image::DepthImage image = s->sample(camera, whole(camera));
  for (uint32_t code : image.depth) EXPECT_NEAR(code, image::encode_depth(2.0, 0.1), 1);
}

TEST(RaySampler, NormalsAreTurnedToTheSideThatIsSeen) {
  const Camera camera = camera_8x8();
  const size_t centre = 8 * 4 + 4;
  for (const glm::vec3& n : {glm::vec3(0.3f, -0.2f, 0.9f), glm::vec3(0.3f, -0.2f, -0.9f)}) {
    const image::DepthImage image = sampler_with(square(1, 0, n))->sample(camera, whole(camera));
    const glm::vec3 expected = n.z > 0 ? n : -n;
    EXPECT_EQ(image.normal[centre], image::encode_normal16(expected));
  }
  // From behind (the camera at z = -2 looks along +z) the same square shows its other side.
  Camera behind = camera;
  behind.pose = geometry::Pose{{0, 0, -2}, glm::dquat(0, 0, 1, 0)};
  const glm::vec3 n(0.3f, -0.2f, 0.9f);
  EXPECT_EQ(sampler_with(square(1, 0, n))->sample(behind, whole(behind)).normal[centre], image::encode_normal16(-n));
}

TEST(RaySampler, OppositeCornerNormalsFallBackToThePlane) {
  const glm::vec3 a(1, 0, 0);
  const Camera camera = geometry::make_camera({}, 90, 1, 1, 0.1);
  // The only ray meets the middle of the lower edge, where the normals a and -a weigh the same.
  auto cancelled = sampler_with(test::triangle({{-3, 0, -1}, a, 0}, {{3, 0, -1}, -a, 0}, {{0, 6, -1}, a, 0}));
  const image::DepthImage image = cancelled->sample(camera, {0, 0, 1, 1});
  ASSERT_NE(image.depth[0], 0u);
  EXPECT_EQ(image.normal[0], image::encode_normal16(kUp));
}

TEST(RaySampler, ColoursAreInterpolatedAndRounded) {
  auto s = sampler_with(
      test::triangle({{-1, -1, -1}, kUp, 0x000000}, {{1, -1, -1}, kUp, 0xff0000}, {{-1, 1, -1}, kUp, 0x00ff64}));
  const Camera camera = camera_8x8();
  const image::DepthImage image = s->sample(camera, whole(camera));
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      if (image.depth[size_t(y) * 8 + x] == 0) continue;
      const double red = (x + 0.5) / 8, other = (7.5 - y) / 8;
      const uint32_t c = image.colour[size_t(y) * 8 + x];
      EXPECT_NEAR(c >> 16 & 255, 255 * red, 0.51);
      EXPECT_NEAR(c >> 8 & 255, 255 * other, 0.51);
      EXPECT_NEAR(c & 255, 100 * other, 0.51);
    }
}

TEST(RaySampler, NearestSurfaceWinsAndTheNearPlaneCuts) {
  auto s = make_ray_sampler(1);
  ASSERT_TRUE(s->add_chunk({7}, square(0.05f, 0xff0000)).ok());  // nearer than near_m: not seen
  ASSERT_TRUE(s->add_chunk({8}, square(3, 0x0000ff, kUp, 5)).ok());
  ASSERT_TRUE(s->add_chunk({9}, square(2, 0x00ff00, kUp, 5)).ok());
  const Camera camera = camera_8x8();
  const image::DepthImage image = s->sample(camera, whole(camera));
  for (uint32_t c : image.colour) EXPECT_EQ(c, 0x00ff00u);
  // A surface at the near plane has the largest depth code.
  auto at_near = sampler_with(square(0.1f + 1e-7f, 0xffffff));
  for (uint32_t code : at_near->sample(camera, whole(camera)).depth) EXPECT_NEAR(code, image::kMaxDepthCode, 32);
}

TEST(RaySampler, ChunksAreReplacedAndRemoved) {
  const Camera camera = camera_8x8();
  auto s = sampler_with(square(1, 0xff0000));
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0xff0000u);
  ASSERT_TRUE(s->add_chunk({0}, square(2, 0x00ff00, kUp, 3)).ok());
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0x00ff00u);
  ASSERT_TRUE(s->add_chunk({1}, square(1, 0x0000ff)).ok());
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0x0000ffu);
  s->remove_chunk({1});
  s->remove_chunk({1});
  s->remove_chunk({99});
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0x00ff00u);
  s->remove_chunk({0});
  EXPECT_EQ(s->sample(camera, whole(camera)), image::DepthImage(8, 8));
}

TEST(RaySampler, LetsGoOfTheCodedBytes) {
  auto chunk = square(1, 0xff0000);
  const std::weak_ptr<const void> owner = chunk.owner;
  auto s = sampler_with(std::move(chunk));
  EXPECT_TRUE(owner.expired());
  const Camera camera = camera_8x8();
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0xff0000u);
}

TEST(RaySampler, RefusesChunksThatDoNotValidateAndKeepsTheOthers) {
  const Camera camera = camera_8x8();
  auto s = sampler_with(square(1, 0xff0000));
  const auto before = s->sample(camera, whole(camera));
  const auto garbage = std::make_shared<std::vector<std::byte>>(640, std::byte{0x5a});
  const Status refused = s->add_chunk({0}, {*garbage, garbage});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("chunk 0"), std::string::npos) << refused.error().text;
  EXPECT_EQ(s->sample(camera, whole(camera)), before);

  std::vector<std::pair<ChunkId, geometry::ChunkBytes>> batch;
  batch.emplace_back(ChunkId{1}, geometry::ChunkBytes{*garbage, garbage});
  batch.emplace_back(ChunkId{2}, square(0.5f, 0x00ff00));
  batch.emplace_back(ChunkId{3}, geometry::ChunkBytes{});
  const Status some = s->add_chunks(std::move(batch));
  ASSERT_FALSE(some.ok());
  EXPECT_NE(some.error().text.find("2 of 3"), std::string::npos) << some.error().text;
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0x00ff00u);
}

TEST(RaySampler, TakesBytesOfAnyAlignment) {
  const auto chunk = square(1, 0xff0000);
  const auto shifted = std::make_shared<std::vector<std::byte>>(chunk.bytes.size() + 1);
  std::memcpy(shifted->data() + 1, chunk.bytes.data(), chunk.bytes.size());
  auto s = sampler_with({std::span<const std::byte>(*shifted).subspan(1), shifted});
  const Camera camera = camera_8x8();
  EXPECT_EQ(s->sample(camera, whole(camera)).colour[27], 0xff0000u);
}

TEST(RaySampler, OffAxisFrustumSeesWhatItShould) {
  // A frustum wholly to the right of the axis: 1 <= u <= 2, 0.5 <= v <= 1.
  Camera camera = camera_8x8();
  camera.left = 1, camera.right = 2, camera.bottom = 0.5, camera.top = 1;
  auto s = sampler_with(test::chunk_of({{{1.25f, 0.5f, -1}, kUp, 0x00ff00},
                                        {{1.75f, 0.5f, -1}, kUp, 0x00ff00},
                                        {{1.75f, 0.75f, -1}, kUp, 0x00ff00},
                                        {{1.25f, 0.75f, -1}, kUp, 0x00ff00}},
                                       {0, 1, 2, 0, 2, 3}));
  const image::DepthImage image = s->sample(camera, whole(camera));
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x)
      EXPECT_EQ(image.depth[size_t(y) * 8 + x] != 0, x >= 2 && x < 6 && y >= 4) << x << "," << y;
}

TEST(RaySampler, ATileIsExactlyTheSamePartOfTheWholeFrame) {
  auto s = make_ray_sampler(2);
  ASSERT_TRUE(s->add_chunks(test::terrain(60, 17)).ok());
  Camera camera = geometry::make_camera({{0.1, 0.45, 0.5}, glm::dquat(0.93, -0.36, 0.05, 0.02)}, 80, 203, 131);
  camera.pose.orientation = glm::normalize(camera.pose.orientation);
  const image::DepthImage frame = s->sample(camera, whole(camera));
  EXPECT_GT(std::count_if(frame.depth.begin(), frame.depth.end(), [](uint32_t d) { return d != 0; }), 8000);
  for (const Rect& tile :
       {Rect{0, 0, 203, 1}, Rect{0, 130, 203, 1}, Rect{3, 5, 1, 1}, Rect{65, 33, 64, 63}, Rect{201, 7, 2, 120}}) {
    const image::DepthImage part = s->sample(camera, tile);
    ASSERT_EQ(part.width, tile.width);
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        const size_t a = size_t(y) * tile.width + x, b = size_t(tile.y + y) * 203 + tile.x + x;
        ASSERT_EQ(part.depth[a], frame.depth[b]);
        ASSERT_EQ(part.colour[a], frame.colour[b]);
        ASSERT_EQ(part.normal[a], frame.normal[b]);
      }
  }
}

TEST(DirectRendering, ShadesEveryPixelOfTheData) {
  const glm::vec3 n = glm::normalize(glm::vec3(0.2f, 0.5f, 0.7f));
  auto s = sampler_with(square(1, 0xc86432, n, 0.5f));
  const Camera camera = camera_8x8();
  const image::Shading shading({}, camera);
  const image::View view = render_directly(*s, camera, shading);
  ASSERT_EQ(view.colour.size(), 64u);
  const float i = shading.intensity(n);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      const size_t at = size_t(y) * 8 + x;
      if (x >= 2 && x < 6 && y >= 2 && y < 6) {
        EXPECT_FLOAT_EQ(view.depth_m[at], 1.0f);
        EXPECT_NEAR(view.colour[at] >> 16 & 255, 0xc8 * i, 0.52);
        EXPECT_NEAR(view.colour[at] >> 8 & 255, 0x64 * i, 0.52);
        EXPECT_NEAR(view.colour[at] & 255, 0x32 * i, 0.52);
      } else {
        EXPECT_TRUE(std::isinf(view.depth_m[at]));
        EXPECT_EQ(view.colour[at], shading.background());
      }
    }
}

}  // namespace
}  // namespace telesplat::sampler
