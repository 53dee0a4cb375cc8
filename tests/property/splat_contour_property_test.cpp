// The splatter's contour is the projection of the sample's footprint: compared with the thesis's matrices, and with
// points on the footprint's rim, projected one by one.
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/trajectory.h"
#include "tests/support/splat_surfel_plain.h"
#include "tests/support/surfel_oracle.h"

namespace telesplat {
namespace {

using testing::Sample;

struct Case {
  geometry::Camera camera;
  Sample sample;
  double depth = 0;
};

class Cases {
 public:
  explicit Cases(uint32_t seed) : rng_(seed) {}

  // Returns any camera, with a sample in its view. `steep`: the sampling view saw it at a slope beyond the limit of
  // stretch.
  Case next(bool steep) {
    Case c;
    const glm::dvec3 eye = 2.0 * direction();
    c.camera = geometry::make_camera(geometry::look_at(eye, 0.5 * direction()), uniform(40, 120), 640, 400);
    c.camera.left -= uniform(0, 0.3), c.camera.top += uniform(0, 0.3);
    c.depth = std::exp(uniform(std::log(0.2), std::log(8.0)));
    c.sample.position = c.camera.unproject(uniform(0, 640), uniform(0, 400), c.depth);
    const glm::dvec3 to_display = glm::normalize(eye - c.sample.position);
    do c.sample.normal = direction();
    while (std::abs(glm::dot(c.sample.normal, to_display)) < 0.15);
    const auto cosine = [&] { return std::abs(glm::dot(c.sample.normal, c.sample.to_eye)); };
    do c.sample.to_eye = direction();
    while (cosine() < 0.02 || (cosine() < splat::kMinSampledCosine) != steep);
    // Radius up to a tenth of the distance: so large that projection is far from parallel.
    c.sample.radius_m = c.depth * std::exp(uniform(std::log(0.0005), std::log(steep ? 0.03 : 0.1)));
    return c;
  }

 private:
  double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(rng_); }
  glm::dvec3 direction() {
    for (;;) {
      const glm::dvec3 d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      if (glm::length(d) > 0.1 && glm::length(d) < 1) return glm::normalize(d);
    }
  }
  std::mt19937 rng_;
};

splat::SurfelContour contour_of(const Case& c) {
  const auto camera = splat::surfel_camera(c.camera);
  const auto source = splat::surfel_source(camera, static_cast<float>(c.sample.radius_m), glm::vec3(c.sample.to_eye));
  const glm::dvec2 p = testing::project(c.camera, c.sample.position);
  const glm::vec3 n(c.sample.normal * 90.0);
  return splat::surfel_contour(camera, source, float(p.x), float(p.y), float(c.depth), {n.x, n.y, n.z});
}

class ContourProperty : public ::testing::TestWithParam<bool> {};

TEST_P(ContourProperty, EqualsTheMatricesOfTheThesis) {
  Cases cases(1);
  for (int i = 0; i < 4000; ++i) {
    const Case c = cases.next(GetParam());
    const testing::CentralConic exact = testing::contour_by_matrices(c.camera, c.sample, true);
    if (!GetParam()) {  // below the limit of stretch it makes no difference
      const testing::CentralConic unlimited = testing::contour_by_matrices(c.camera, c.sample, false);
      ASSERT_LT(glm::distance(unlimited.centre, exact.centre), 1e-9);
    }
    const splat::SurfelContour s = contour_of(c);
    const glm::dvec2 centre = testing::project(c.camera, c.sample.position) + glm::dvec2(s.offset_x, s.offset_y);
    const glm::dmat2 inverse = glm::inverse(exact.q);  // S
    const double size = inverse[0][0] + inverse[1][1];
    ASSERT_LT(glm::distance(centre, exact.centre), 1e-3 * std::sqrt(size)) << i;
    ASSERT_NEAR(s.xx, inverse[0][0], 1e-3 * size) << i;
    ASSERT_NEAR(s.xy, inverse[0][1], 1e-3 * size) << i;
    ASSERT_NEAR(s.yy, inverse[1][1], 1e-3 * size) << i;
  }
}

TEST_P(ContourProperty, RimPointsLieOnItAndTouchItsBox) {
  Cases cases(2);
  for (int i = 0; i < 1000; ++i) {
    const Case c = cases.next(GetParam());
    const splat::SurfelContour s = contour_of(c);
    const glm::dvec2 centre = testing::project(c.camera, c.sample.position) + glm::dvec2(s.offset_x, s.offset_y);
    const glm::dmat2 inverse = glm::inverse(glm::dmat2(s.xx, s.xy, s.xy, s.yy));
    const double condition =
        (double(s.xx) + s.yy) * (double(s.xx) + s.yy) / (double(s.xx) * s.yy - double(s.xy) * s.xy);
    double widest = 0, highest = 0;
    for (int j = 0; j < 720; ++j) {
      const glm::dvec2 d =
          testing::project(c.camera, testing::rim_point(c.sample, j * 3.14159265358979 / 360, true)) - centre;
      ASSERT_NEAR(glm::dot(d, inverse * d), 1.0, 1e-3 + 1e-6 * condition) << i;
      widest = std::max(widest, std::abs(d.x)), highest = std::max(highest, std::abs(d.y));
    }
    ASSERT_NEAR(widest, std::sqrt(s.xx), 2e-3 * std::sqrt(s.xx)) << i;
    ASSERT_NEAR(highest, std::sqrt(s.yy), 2e-3 * std::sqrt(s.yy)) << i;
  }
}

TEST_P(ContourProperty, DepthFollowsTheTangentPlane) {
  Cases cases(3);
  for (int i = 0; i < 1000; ++i) {
    const Case c = cases.next(GetParam());
    const splat::SurfelContour s = contour_of(c);
    const glm::dvec2 p = testing::project(c.camera, c.sample.position);
    const double limit_x = splat::kSteepest / c.camera.focal_x(), limit_y = splat::kSteepest / c.camera.focal_y();
    if (std::abs(s.slope_x) > 0.999 * limit_x || std::abs(s.slope_y) > 0.999 * limit_y) continue;
    for (int j = 0; j < 8; ++j) {
      const glm::dvec3 q = testing::rim_point(c.sample, j, true);
      const double depth = glm::dot(c.camera.room_to_pixel().w, glm::dvec4(q, 1));
      const glm::dvec2 d = testing::project(c.camera, q) - p;
      ASSERT_NEAR(c.depth / (1 + s.slope_x * d.x + s.slope_y * d.y), depth, 1e-3 * depth) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Slopes, ContourProperty, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "beyond_the_limit" : "within_the_limit"; });

}  // namespace
}  // namespace telesplat
