// Contours of single splats whose shape is known without any formula.
#include <gtest/gtest.h>

#include "common/geometry/trajectory.h"
#include "common/image/normal.h"
#include "tests/support/splat_surfel_plain.h"

namespace telesplat {
namespace {

// Looks along -z from the origin, 90 degrees wide: 100 pixels per unit tangent.
const geometry::Camera kCamera = geometry::make_camera({}, 90, 200, 120);

splat::SurfelContour contour(const glm::vec3& position, const glm::vec3& normal, const glm::vec3& to_eye,
                             float radius) {
  const auto camera = splat::surfel_camera(kCamera);
  const float w = -position.z;
  return splat::surfel_contour(camera, splat::surfel_source(camera, radius, to_eye), 100 + 100 * position.x / w,
                               60 - 100 * position.y / w, w, {normal.x, normal.y, normal.z});
}

TEST(SurfelContour, FacingDiscIsACircle) {
  const auto c = contour({0, 0, -2}, {0, 0, 127}, {0, 0, 1}, 0.1f);
  EXPECT_NEAR(c.xx, 25.0f, 1e-3f);
  EXPECT_NEAR(c.yy, 25.0f, 1e-3f);
  EXPECT_NEAR(c.xy, 0.0f, 1e-4f);
  EXPECT_NEAR(c.offset_x, 0.0f, 1e-4f);
  EXPECT_NEAR(c.slope_x, 0.0f, 1e-6f);
}

TEST(SurfelContour, FacingDiscOffAxisStaysACircle) {
  // A disc parallel to the screen keeps its shape in perspective at any place.
  const auto c = contour({1.5f, -0.8f, -2}, {0, 0, 127}, {0, 0, 1}, 0.1f);
  EXPECT_NEAR(c.xx, 25.0f, 2e-3f);
  EXPECT_NEAR(c.yy, 25.0f, 2e-3f);
  EXPECT_NEAR(c.xy, 0.0f, 2e-3f);
  EXPECT_NEAR(c.offset_x, 0.0f, 1e-3f);
}

TEST(SurfelContour, SlopeSeenFromWhereItWasSampledIsTheSamplesCircle) {
  // Displaying shortens the slope by as much as sampling stretched it.
  const auto c = contour({0, 0, -2}, {100, 0, 100}, {0, 0, 1}, 0.01f);
  EXPECT_NEAR(c.xx, 0.25f, 1e-3f);
  EXPECT_NEAR(c.yy, 0.25f, 1e-3f);
}

TEST(SurfelContour, SlopeSampledFromItsFrontIsShortened) {
  const auto c = contour({0, 0, -2}, {100, 0, 100}, glm::normalize(glm::vec3(1, 0, 1)), 0.01f);
  EXPECT_NEAR(c.xx, 0.125f, 1e-3f);
  EXPECT_NEAR(c.yy, 0.25f, 1e-3f);
  // The splat's plane: x + z = -2. On the ray through (u, v) its depth is 2 / (1 - u): farther to the right.
  EXPECT_NEAR(c.slope_x, -0.01f, 1e-6f);
  EXPECT_NEAR(c.slope_y, 0.0f, 1e-6f);
}

TEST(SurfelContour, SilhouettesAreStretchedNoFartherThanTheLimit) {
  const auto c = contour({0, 0, -2}, {0, 0, 127}, {1, 0, 0}, 0.01f);
  const float limit = 1.0f + 1.0f / (splat::kMinSampledCosine * splat::kMinSampledCosine);
  EXPECT_NEAR(c.xx, 0.25f * limit, 2e-3f);
  EXPECT_NEAR(c.yy, 0.25f, 1e-3f);
}

TEST(SurfelContour, StaysFiniteInTheEyeAndEdgeOn) {
  for (const glm::vec3& position : {glm::vec3(0, 0, -0.001f), glm::vec3(0, 0, -1)})
    for (const glm::vec3& normal : {glm::vec3(0, 0, 127), glm::vec3(127, 0, 0), glm::vec3(63, 64, 0)})
      for (const float radius : {0.0f, 0.5f, 1e6f}) {
        const auto c = contour(position, normal, {0, 0, 1}, radius);
        for (const float v :
             {c.xx, c.xy, c.yy, c.offset_x, c.offset_y, c.slope_x, c.slope_y, c.xx * c.yy - c.xy * c.xy})
          EXPECT_TRUE(std::isfinite(v)) << radius;
        EXPECT_GE(c.xx, 0.0f);
        EXPECT_GE(c.yy, 0.0f);
      }
}

TEST(SurfelNormal, IsTheDecodedNormalScaled) {
  for (uint32_t code = 0; code < 65536; ++code) {
    const auto [x, y, z] = splat::surfel_normal(static_cast<uint16_t>(code));
    const glm::vec3 expected = image::decode_normal16(static_cast<uint16_t>(code));
    ASSERT_LT(glm::distance(glm::normalize(glm::vec3(x, y, z)), expected), 1e-5f) << code;
  }
}

}  // namespace
}  // namespace telesplat
