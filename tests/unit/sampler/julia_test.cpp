// Promises of the Julia sampler: canonical images, pixels that do not depend on the rectangle, normals, colours, and
// odd cameras and sets.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/geometry/trajectory.h"
#include "common/image/measures/reference.h"
#include "common/image/normal.h"
#include "services/sampler/julia/sampler.h"
#include "tests/support/julia/reference.h"

namespace telesplat::sampler {
namespace {

struct Scene {
  explicit Scene(const julia::Parameters& p)
      : parameters(p), placement(julia::place(julia::bounds(p), 0.8)), scene(p, placement) {}
  julia::Parameters parameters;
  julia::Placement placement;
  JuliaScene scene;
};

geometry::Camera camera(int width = 160, int height = 100) {
  return geometry::make_camera(geometry::default_pose(), 70, width, height);
}
image::DepthImage whole(const JuliaScene& scene, const geometry::Camera& c, int threads = 1) {
  return JuliaSampler(threads).sample(scene, c, {0, 0, c.width, c.height}, 1);
}
size_t covered(const image::DepthImage& image) {
  return static_cast<size_t>(std::count_if(image.depth.begin(), image.depth.end(), [](uint32_t d) { return d != 0; }));
}

// c = 0: the filled-in set is the unit ball, and its slice is a ball, too.
julia::Parameters ball(double offset = 0) {
  julia::Parameters p;
  p.slice_offset = offset;
  p.ambient = 0;
  return p;
}

TEST(JuliaSampler, SampledBallIsABall) {
  const Scene s(ball(0.6));
  const geometry::Camera c = camera();
  const image::DepthImage image = whole(s.scene, c);
  ASSERT_GT(covered(image), image.pixels() / 20);
  // For q^2 the distance estimate is 0.5 |q| log|q|, near |q| = 1 about (|q| - 1) / 2. It reaches half a footprint at
  // |q| = 1 + a footprint; in the slice, where the ball's radius is 0.8, that is 1 / 0.8 of a footprint outside.
  const double footprint = 1 / c.focal_x(), radius = 0.8 * s.placement.scale;
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      const size_t at = size_t(y) * c.width + x;
      if (image.depth[at] == 0) continue;
      const double depth = image::decode_depth(image.depth[at], c.near_m);
      const glm::dvec3 p = c.unproject(x + 0.5, y + 0.5, depth);
      ASSERT_NEAR(glm::length(p), radius + 1.25 * footprint * depth, 0.1 * footprint * depth) << x << "," << y;
      const glm::dvec3 n = image::decode_normal16(image.normal[at]);
      ASSERT_GT(glm::dot(n, glm::normalize(p)), 0.999) << x << "," << y;
    }
}

TEST(JuliaSampler, PixelsDoNotDependOnTheRectangle) {
  const Scene s(julia::presets()[0].parameters);
  const geometry::Camera c = camera(165, 101);
  const image::DepthImage all = whole(s.scene, c);
  JuliaSampler sampler(2);
  for (const geometry::Rect r :
       {geometry::Rect{0, 50, 165, 1}, {0, 37, 165, 3}, {61, 33, 1, 1}, {3, 5, 147, 90}, {160, 96, 5, 5}}) {
    const image::DepthImage part = sampler.sample(s.scene, c, r, 1);
    ASSERT_EQ(part.width, r.width);
    ASSERT_EQ(part.height, r.height);
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x) {
        const size_t a = size_t(y) * r.width + x, b = size_t(r.y + y) * c.width + r.x + x;
        ASSERT_EQ(part.depth[a], all.depth[b]) << r.x + x << "," << r.y + y;
        ASSERT_EQ(part.colour[a], all.colour[b]);
        ASSERT_EQ(part.normal[a], all.normal[b]);
      }
  }
  EXPECT_TRUE(sampler.sample(s.scene, c, {10, 10, 0, 5}, 1).depth.empty());
}

TEST(JuliaSampler, ImagesAreCanonicalAndNormalsFaceTheViewer) {
  for (const julia::Preset& preset : julia::presets()) {
    SCOPED_TRACE(std::string(preset.name));
    const Scene s(preset.parameters);
    const geometry::Camera c = camera();
    const image::DepthImage image = whole(s.scene, c);
    ASSERT_GT(covered(image), image.pixels() / 50);
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        const size_t at = size_t(y) * c.width + x;
        ASSERT_LE(image.depth[at], image::kMaxDepthCode);
        ASSERT_LE(image.colour[at], 0xffffffu);
        if (image.depth[at] == 0) {
          ASSERT_EQ(image.colour[at], 0u);
          ASSERT_EQ(image.normal[at], 0u);
          continue;
        }
        const glm::dvec3 ray = glm::normalize(c.unproject(x + 0.5, y + 0.5, 1) - c.pose.position_room);
        ASSERT_LT(glm::dot(glm::dvec3(image::decode_normal16(image.normal[at])), ray), 0.02);  // normals are quantised
      }
  }
}

TEST(JuliaSampler, NormalsFollowTheSurface) {
  // Compares with cross products of neighbours' positions, where the surface is smooth enough.
  const Scene s(julia::presets()[0].parameters);
  const geometry::Camera c = camera(640, 400);
  const image::DepthImage image = whole(s.scene, c);
  size_t compared = 0, alike = 0;
  const auto at = [&](int x, int y) { return size_t(y) * c.width + x; };
  const auto point = [&](int x, int y) {
    return c.unproject(x + 0.5, y + 0.5, image::decode_depth(image.depth[at(x, y)], c.near_m));
  };
  for (int y = 1; y + 1 < c.height; ++y)
    for (int x = 1; x + 1 < c.width; ++x) {
      if (!image.depth[at(x, y)] || !image.depth[at(x - 1, y)] || !image.depth[at(x + 1, y)] ||
          !image.depth[at(x, y - 1)] || !image.depth[at(x, y + 1)])
        continue;
      const glm::dvec3 p = point(x, y), dx = point(x + 1, y) - point(x - 1, y), dy = point(x, y - 1) - point(x, y + 1);
      const double pixel = 2 * glm::length(p - c.pose.position_room) / c.focal_x();
      if (glm::length(dx) > 2 * pixel || glm::length(dy) > 2 * pixel) continue;
      ++compared;
      alike += glm::dot(glm::normalize(glm::cross(dx, dy)),
                        glm::dvec3(image::decode_normal16(image.normal[at(x, y)]))) > 0.95;
    }
  ASSERT_GT(compared, 5000u);
  EXPECT_GT(double(alike), 0.93 * double(compared));  // the surface has creases
}

TEST(JuliaSampler, StepKeepsTheFootprintOfTheFullCamera) {
  // A camera of every fourth pixel of every fourth row sees the same there as the full one.
  const Scene s(julia::presets()[0].parameters);
  const geometry::Camera full = camera(320, 200);
  geometry::Camera coarse = full;
  coarse.width /= 4, coarse.height /= 4;
  const double dx = 1.5 / full.focal_x(), dy = 1.5 / full.focal_y();  // pixel (x, y) becomes (4 x, 4 y)
  coarse.left -= dx, coarse.right -= dx, coarse.top += dy, coarse.bottom += dy;
  const image::DepthImage fine = whole(s.scene, full);
  const image::DepthImage sparse = JuliaSampler(1).sample(s.scene, coarse, {0, 0, coarse.width, coarse.height}, 0.25);
  size_t both = 0, alike = 0, one = 0;
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x) {
      const uint32_t a = sparse.depth[size_t(y) * coarse.width + x], b = fine.depth[size_t(4 * y) * full.width + 4 * x];
      one += (a == 0) != (b == 0);
      if (a == 0 || b == 0) continue;
      ++both;
      const double da = image::decode_depth(a, full.near_m), db = image::decode_depth(b, full.near_m);
      alike += std::abs(da - db) < 0.5 * db / full.focal_x();
    }
  ASSERT_GT(both, 500u);
  EXPECT_GE(alike + 3, both);
  EXPECT_LE(one, 3u);
}

// Casts four by four rays for each pixel of `c`, each ray with the footprint of the whole pixel.
image::Reference sixteen_rays(const JuliaScene& scene, const geometry::Camera& c, const image::Shading& shading) {
  return *image::supersample(c, 16, [&](const geometry::Camera& part) {
    return Result<image::View>(render_julia_directly(scene, part, shading, 1, 4));
  });
}

TEST(JuliaSampler, FinerCamerasSeeTheSurfaceOfTheView) {
  // A camera of 3 x 3 rays a pixel casts, among others, the rays at the middles of the view's pixels.
  const Scene s(julia::presets()[0].parameters);
  const geometry::Camera view = camera(320, 200);
  geometry::Camera fine = view;
  fine.width *= 3, fine.height *= 3;
  const geometry::Rect all{0, 0, fine.width, fine.height};
  const image::DepthImage own = whole(s.scene, view);
  const auto differ = [&](double footprint_px) {
    const image::DepthImage image = JuliaSampler(1).sample(s.scene, fine, all, footprint_px);
    size_t out = 0;
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        const uint32_t a = own.depth[size_t(y) * view.width + x],
                       b = image.depth[size_t(3 * y + 1) * fine.width + 3 * x + 1];
        out += (a == 0) != (b == 0) ||
               (a && std::abs(image::decode_depth(a, view.near_m) / image::decode_depth(b, view.near_m) - 1) *
                             view.focal_x() >
                         0.5);
      }
    return out;
  };
  EXPECT_LT(differ(3), covered(own) / 500);  // single rays that graze the surface
  EXPECT_GT(differ(1), covered(own) / 20);   // with a footprint of a third of a pixel the surface lies deeper
}

TEST(JuliaSampler, RimsAreNotDottedWithDarkPixels) {
  // Folds seen from the side end in rims that turn away within a pixel.
  const Scene s(julia::presets()[0].parameters);
  const geometry::Camera c = camera(800, 500);
  const image::Shading shading({}, c);
  const image::View one = render_julia_directly(s.scene, c, shading, 1);
  const image::Reference truth = sixteen_rays(s.scene, c, shading);
  size_t shown = 0, dark = 0;
  for (size_t i = 0; i < one.colour.size(); ++i) {
    if (!std::isfinite(one.depth_m[i]) || !std::isfinite(truth.view.depth_m[i])) continue;
    ++shown;
    const auto red = [](uint32_t colour) { return int(colour >> 16 & 255); };
    dark += red(one.colour[i]) + 30 < red(truth.view.colour[i]);
  }
  ASSERT_GT(shown, 50000u);
  EXPECT_LT(dark, 55u);  // measured 29; 102 if each normal is that of its point alone
}

TEST(JuliaSampler, BoxThatCutsTheSetShowsItsFaces) {
  julia::Parameters p = ball();
  p.bound = 0.5;  // a cube inside the ball
  const Scene s(p);
  const geometry::Camera c = geometry::make_camera(geometry::look_at({0, 0, 1}, {0, 0, 0}), 60, 64, 64);
  const image::DepthImage image = whole(s.scene, c);
  const size_t middle = 32 * 64 + 32;
  ASSERT_NE(image.depth[middle], 0u);
  EXPECT_NEAR(image::decode_depth(image.depth[middle], c.near_m), 0.6, 1e-4);
  EXPECT_GT(image::decode_normal16(image.normal[middle]).z, 0.999f);
}

TEST(JuliaSampler, CameraInsideTheSetSeesItAtTheNearPlane) {
  const Scene s(ball());
  const geometry::Camera c = geometry::make_camera(geometry::look_at({0, 0, 0.1}, {0, 0, -1}), 90, 16, 16);
  const image::DepthImage image = whole(s.scene, c);
  EXPECT_EQ(covered(image), image.pixels());
  for (uint32_t d : image.depth) EXPECT_NEAR(image::decode_depth(d, c.near_m), c.near_m, 1e-6);
}

TEST(JuliaSampler, CamerasAtTheLimitsComeToAnEnd) {
  const Scene s(julia::presets()[0].parameters);
  geometry::Camera narrow = camera(64, 8);
  narrow.left = -6e-7, narrow.right = 6e-7, narrow.bottom = -6e-7,
  narrow.top = 6e-7;  // footprints below the rounding of depths
  EXPECT_EQ(whole(s.scene, narrow).pixels(), 512u);
  geometry::Camera far = camera(64, 8);
  far.pose.position_room = {1e6, -1e6, 1e6};
  EXPECT_EQ(covered(whole(s.scene, far)), 0u);
  geometry::Camera wide = camera(64, 8);
  wide.left = -1000, wide.right = 1000, wide.near_m = 1e-6;
  EXPECT_EQ(whole(s.scene, wide).pixels(), 512u);
}

TEST(JuliaSampler, ParametersAtTheLimitsComeToAnEnd) {
  const julia::Placement placement{glm::dvec3(0), 0.4, {glm::vec3(-0.4f), glm::vec3(0.4f)}};
  for (const julia::ParameterInfo& info : julia::parameter_infos())
    for (const double value : {info.least, info.most}) {
      SCOPED_TRACE(std::string(info.name) + " " + std::to_string(value));
      julia::Parameters p = julia::presets()[0].parameters;
      ASSERT_TRUE(julia::set(p, info.name, value).ok());
      const geometry::Camera c = camera(48, 30);
      const image::DepthImage image = whole(JuliaScene(p, placement), c);
      for (size_t i = 0; i < image.pixels(); ++i)
        ASSERT_TRUE(image.depth[i] != 0 || (image.colour[i] == 0 && image.normal[i] == 0));
    }
}

TEST(JuliaSampler, OcclusionAndShadowOnlyDarken) {
  julia::Parameters p = julia::presets()[0].parameters;
  p.ambient = 0;
  const geometry::Camera c = camera();
  const image::DepthImage plain = whole(Scene(p).scene, c);
  p.ambient = 1;
  const image::DepthImage occluded = whole(Scene(p).scene, c);
  p.ambient = 0, p.shadow = 1;
  const image::DepthImage shadowed = whole(Scene(p).scene, c);
  EXPECT_EQ(plain.depth, occluded.depth);
  EXPECT_EQ(plain.normal, shadowed.normal);
  size_t darker_occluded = 0, darker_shadowed = 0, black = 0;
  for (size_t i = 0; i < plain.pixels(); ++i)
    for (int shift : {0, 8, 16}) {
      const uint32_t a = plain.colour[i] >> shift & 255, b = occluded.colour[i] >> shift & 255,
                     d = shadowed.colour[i] >> shift & 255;
      ASSERT_LE(b, a);
      ASSERT_LE(d, a);
      darker_occluded += b < a, darker_shadowed += d < a, black += plain.depth[i] != 0 && d == 0;
    }
  EXPECT_GT(darker_occluded, covered(plain) / 2);
  EXPECT_GT(darker_shadowed, covered(plain) / 10);
  EXPECT_LT(black, 3 * covered(plain) * 9 / 10);
}

TEST(JuliaSampler, DirectRenderingSeesTheSameSurface) {
  const Scene s(julia::presets()[0].parameters);
  const geometry::Camera c = camera();
  const image::DepthImage image = whole(s.scene, c);
  const image::Shading shading({}, c);
  const image::View view = render_julia_directly(s.scene, c, shading, 1);
  for (size_t i = 0; i < image.pixels(); ++i) {
    if (image.depth[i] == 0) {
      ASSERT_EQ(view.colour[i], shading.background());
      ASSERT_EQ(view.depth_m[i], std::numeric_limits<float>::infinity());
      continue;
    }
    ASSERT_NEAR(view.depth_m[i], image::decode_depth(image.depth[i], c.near_m), 1e-5);
    const uint32_t lit = image::Shading::apply(image.colour[i], shading.table()[image.normal[i]]);
    for (int shift : {0, 8, 16}) ASSERT_NEAR(view.colour[i] >> shift & 255, lit >> shift & 255, 6);
  }
}

TEST(JuliaPalette, OneForEveryNameSmoothAndPeriodic) {
  ASSERT_EQ(julia_palette_count(), static_cast<int>(julia::palette_names().size()));
  for (int i = 0; i < julia_palette_count(); ++i) {
    const JuliaPalette& palette = julia_palette(i);
    for (int k = 0; k <= 1024; ++k) {
      const float t = float(k) / 1024;
      const glm::vec3 a = palette.at(t), b = palette.at(t + 1.0f / 1024);
      EXPECT_EQ(a, palette.at(t + 3)) << t;
      for (int c = 0; c < 3; ++c) EXPECT_LT(std::abs(a[c] - b[c]), 3) << julia::palette_names()[i] << " " << t;
    }
    EXPECT_EQ(palette.at(std::numeric_limits<float>::infinity()), palette.at(0));
    EXPECT_EQ(palette.at(std::numeric_limits<float>::quiet_NaN()), palette.at(0));
    EXPECT_EQ(palette.at(-0.25f), palette.at(0.75f));
    EXPECT_EQ(palette.rounded(0.3f, 0), 0u);
  }
}

}  // namespace
}  // namespace telesplat::sampler
