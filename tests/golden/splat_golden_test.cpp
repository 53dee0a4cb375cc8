// Both renderers against committed pictures, every kernel. A failing case leaves reference, rendered and difference
// images in the build folder (golden-failures/). To accept new pictures, look at them and run with
// TELESPLAT_UPDATE_GOLDEN=1.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <map>

#include "client/viewer/render/gl/gl_renderer.h"
#include "common/geometry/trajectory.h"
#include "common/image/measures/quality.h"
#include "tests/support/splat_scene.h"

namespace telesplat {
namespace {

constexpr int kWidth = 240, kHeight = 150;

// A torus with a coloured stripe around it, above a chequered floor: curved and flat, near and far, edges before a
// background.
double distance_to_scene(const glm::dvec3& p) {
  const glm::dvec2 q(std::hypot(p.x, p.z) - 0.24, p.y - 0.03);
  return std::min(std::hypot(q.x, q.y) - 0.09, p.y + 0.12);
}

struct Hit {
  bool any = false;
  double depth_m = 0;
  uint32_t albedo = 0;
  glm::vec3 normal{0};
};

Hit trace(const geometry::Camera& camera, int x, int y) {
  const glm::dvec3 eye = camera.pose.position_room, step = camera.unproject(x + 0.5, y + 0.5, 1.0) - eye;
  const double length = glm::length(step);
  double depth = 0.05;
  for (int i = 0; i < 300 && depth < 3; ++i) {
    const glm::dvec3 p = eye + step * depth;
    const double d = distance_to_scene(p);
    if (d < 1e-6) {
      if (std::max(std::abs(p.x), std::abs(p.z)) > 0.4) return {};  // beyond the floor
      const double e = 1e-5;
      const auto slope = [&](const glm::dvec3& axis) {
        return distance_to_scene(p + axis * e) - distance_to_scene(p - axis * e);
      };
      const glm::dvec3 n(slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1}));
      const bool chequer = (int(std::floor(p.x * 20)) + int(std::floor(p.z * 20))) & 1;
      const uint32_t floor_albedo = chequer ? 0xc8c0b0 : 0x405060;
      const uint32_t torus_albedo = std::abs(std::sin(6 * std::atan2(p.z, p.x))) > 0.5 ? 0xd04030 : 0xf0d060;
      return {true, depth, p.y < -0.1199 ? floor_albedo : torus_albedo, glm::normalize(glm::vec3(n))};
    }
    depth += d / length;
  }
  return {};
}

image::DepthImage sample(const geometry::Camera& camera) {
  image::DepthImage out(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      if (const Hit hit = trace(camera, x, y); hit.any) {
        const size_t i = size_t(y) * camera.width + x;
        out.depth[i] = image::encode_depth(hit.depth_m, camera.near_m);
        out.colour[i] = hit.albedo;
        out.normal[i] = image::encode_normal16(hit.normal);
      }
  return out;
}

const points::PointModel& model() {
  static points::PointModel m({{{-0.4f, -0.2f, -0.4f}, {0.4f, 0.2f, 0.4f}}, 5});
  if (m.points() == 0)
    for (int i = 0; i < 3; ++i) {
      const double angle = 0.5 + 1.2 * i;
      const geometry::Camera camera = geometry::make_camera(
          geometry::look_at({0.6 * std::sin(angle), 0.4, 0.6 * std::cos(angle)}, {0, -0.03, 0}), 75, 160, 100);
      m.insert(points::prepare_patch(m.config(), Sequence{uint64_t(i) + 1}, camera, {0, 0, 160, 100}, sample(camera)));
    }
  return m;
}

geometry::Camera display_camera() {
  return geometry::make_camera(geometry::look_at({0.35, 0.33, 0.4}, {0, -0.03, 0}), 80, kWidth, kHeight);
}

image::View direct_view(const geometry::Camera& camera, const image::Shading& shading) {
  image::View out{kWidth, kHeight, std::vector<uint32_t>(size_t{kWidth} * kHeight, shading.background()),
                  std::vector<float>(size_t{kWidth} * kHeight, std::numeric_limits<float>::infinity())};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (const Hit hit = trace(camera, x, y); hit.any) {
        const size_t i = size_t(y) * kWidth + x;
        out.colour[i] = image::Shading::apply(hit.albedo, shading.table()[image::encode_normal16(hit.normal)]);
        out.depth_m[i] = static_cast<float>(hit.depth_m);
      }
  return out;
}

// Squares need a little more than the samples' distance to close a surface, discs its diagonal.
float splat_scale(splat::Kernel kernel) { return kernel == splat::Kernel::kSquare ? 1.1f : 1.5f; }

image::View render(viewer::Renderer& renderer, splat::Kernel kernel, float scale) {
  const geometry::Camera camera = display_camera();
  const image::Shading shading({}, camera);
  splat::SelectionOptions options;
  options.scale = scale;
  splat::DrawList list;
  splat::select_view(model(), camera, options, list);
  image::View out{kWidth, kHeight, std::vector<uint32_t>(size_t{kWidth} * kHeight),
                  std::vector<float>(size_t{kWidth} * kHeight)};
  renderer.render(list, camera, kernel, shading, {kWidth, kHeight, out.colour.data(), out.depth_m.data()});
  for (uint32_t& c : out.colour) c &= 0xffffff;
  return out;
}

struct Difference {
  int largest = 0;            ///< in one channel
  double mean = 0;            ///< over all channels
  double largest_window = 0;  ///< mean over the worst 8x8 window
  double pixels = 0;          ///< share that differs at all
  std::vector<uint32_t> image;
};

Difference difference(const image::View& a, const image::View& b) {
  Difference d;
  d.image.resize(a.colour.size());
  std::vector<int> sums(a.colour.size());
  size_t different = 0;
  for (size_t i = 0; i < a.colour.size(); ++i) {
    for (int shift : {16, 8, 0}) {
      const int delta = std::abs(int(a.colour[i] >> shift & 255) - int(b.colour[i] >> shift & 255));
      d.largest = std::max(d.largest, delta);
      sums[i] += delta;
      d.image[i] |= uint32_t(std::min(255, 4 * delta)) << shift;
    }
    d.mean += sums[i] / (3.0 * double(a.colour.size()));
    different += sums[i] > 0;
  }
  for (int y = 0; y + 8 <= a.height; y += 4)
    for (int x = 0; x + 8 <= a.width; x += 4) {
      double window = 0;
      for (int j = 0; j < 64; ++j) window += sums[size_t(y + j / 8) * a.width + x + j % 8] / 192.0;
      d.largest_window = std::max(d.largest_window, window);
    }
  d.pixels = double(different) / double(a.colour.size());
  return d;
}

// Limits of a picture's difference from the committed one.
struct Tolerance {
  double mean, window, pixels;
};

void expect_like(const image::View& reference, const image::View& rendered, const Tolerance& tolerance,
                 const std::string& name) {
  const Difference d = difference(reference, rendered);
  const bool good = d.mean <= tolerance.mean && d.largest_window <= tolerance.window && d.pixels <= tolerance.pixels;
  std::printf("%s: mean %.4f, worst window %.3f, share of pixels %.5f\n", name.c_str(), d.mean, d.largest_window,
              d.pixels);
  EXPECT_TRUE(good) << name << ": mean " << d.mean << ", worst window " << d.largest_window << ", share of pixels "
                    << d.pixels << ", largest " << d.largest;
  if (good) return;
  const std::filesystem::path folder = std::filesystem::path(TELESPLAT_GOLDEN_OUT) / "golden-failures";
  std::filesystem::create_directories(folder);
  const auto keep = [&](const std::string& what, const image::View& view) {
    const auto written = image::write_png((folder / (name + "-" + what + ".png")).string(), view);
    EXPECT_TRUE(written.ok());
  };
  keep("reference", reference);
  keep("rendered", rendered);
  keep("difference", {kWidth, kHeight, d.image, {}});
}

// Fails the test if a renderer cannot be made. On a machine without OpenGL it returns null and the reason instead.
std::unique_ptr<viewer::Renderer> make(const std::string& kind, std::string& why_not) {
  if (kind == "gl")
    if (const auto context = gl::EglContext::make(); !context) {
      why_not = context.error().text;
      return nullptr;
    }
  auto made = viewer::make_renderer(kind, 2);
  if (made) return std::move(*made);
  ADD_FAILURE() << made.error().text;
  return nullptr;
}

class SplatGolden : public ::testing::TestWithParam<std::tuple<std::string, splat::Kernel>> {};

TEST_P(SplatGolden, LooksAsCommitted) {
  const auto& [kind, kernel] = GetParam();
  std::string why_not;
  const auto renderer = make(kind, why_not);
  if (!renderer) GTEST_SKIP() << why_not;
  const image::View rendered = render(*renderer, kernel, splat_scale(kernel));
  const std::string shape(splat::kernel_name(kernel)), path = "tests/golden/images/splat-" + shape + ".png";
  if (std::getenv("TELESPLAT_UPDATE_GOLDEN") && kind == "cpu") {
    ASSERT_TRUE(image::write_png(path, rendered).ok());
  }
  const auto reference = image::read_view(path);
  ASSERT_TRUE(reference) << reference.error().text;
  ASSERT_EQ(reference->width, kWidth);
  ASSERT_EQ(reference->height, kHeight);
  // The CPU's arithmetic is exact; the sines of the compiler's library may move a sample of the scene. GPUs round
  // divisions their own way.
  const Tolerance tolerance = kind == "cpu" ? Tolerance{0.02, 1.0, 0.001} : Tolerance{0.03, 4.0, 0.003};
  expect_like(*reference, rendered, tolerance, "splat-" + shape + "-" + kind);
}

TEST_P(SplatGolden, IsCloseToTracingTheScene) {
  const auto& [kind, kernel] = GetParam();
  std::string why_not;
  const auto renderer = make(kind, why_not);
  if (!renderer) GTEST_SKIP() << why_not;
  const geometry::Camera camera = display_camera();
  const image::View direct = direct_view(camera, image::Shading({}, camera));
  const image::Quality q = image::compare(direct, render(*renderer, kernel, splat_scale(kernel)));
  // Sampled at two thirds of the display's resolution: edges of the pattern become steps of one and a half pixels.
  EXPECT_GT(q.psnr_db, 19.0);
  EXPECT_GT(q.ssim, 0.65);
  // No sampling view saw some parts of the scene.
  EXPECT_LT(q.hole_fraction, 0.05);
  std::printf("%s: PSNR %.2f dB, SSIM %.3f, holes %.4f\n", kind.c_str(), q.psnr_db, q.ssim, q.hole_fraction);
}

INSTANTIATE_TEST_SUITE_P(Renderers, SplatGolden,
                         ::testing::Combine(::testing::Values("cpu", "gl"), ::testing::ValuesIn(splat::kKernels)),
                         [](const auto& info) {
                           return std::get<0>(info.param) + "_" +
                                  std::string(splat::kernel_name(std::get<1>(info.param)));
                         });

// ewa adds up floats, in a different order on each renderer.
bool same_colour(uint32_t a, uint32_t b, splat::Kernel kernel) {
  const int tolerance = kernel == splat::Kernel::kEwa ? 2 : 0;
  for (int shift : {16, 8, 0})
    if (std::abs(int(a >> shift & 255) - int(b >> shift & 255)) > tolerance) return false;
  return true;
}

// Compares the two renderers: colours and depths, frame after frame from one GL renderer, so that its kept copies,
// items that it may not keep, and changes of size are tested too.
TEST(RenderersAgree, FrameAfterFrame) {
  std::string why_not;
  const auto gl = make("gl", why_not);
  if (!gl) GTEST_SKIP() << why_not;
  const auto cpu = viewer::make_cpu_renderer(2);
  double most[splat::kKernels.size()] = {};
  for (int frame = 0; frame < 24; ++frame) {
    const int width = frame % 5 == 4 ? 133 : 200, height = frame % 5 == 4 ? 77 : 120;
    const geometry::Camera camera = geometry::make_camera(
        geometry::look_at({0.6 * std::sin(0.3 * frame), 0.3, 0.6 * std::cos(0.3 * frame)}, {0, 0, 0}), 70, width,
        height);
    const image::Shading shading({}, camera);
    splat::SelectionOptions options;
    options.scale = 0.9f + 0.3f * float(frame % 7);
    splat::DrawList list;
    splat::select_view(model(), camera, options, list);
    auto made = testing::random_items(static_cast<uint32_t>(frame), 12, 60);
    for (auto& m : made) list.items.push_back(m.item(1.0f + 0.7f * float(frame % 12)));
    const splat::Kernel kernel = splat::kKernels[static_cast<size_t>(frame) % std::size(splat::kKernels)];
    testing::Frame a(width, height), b(width, height);
    const splat::Finish finish{frame % 3 == 1, frame % 3 != 0, frame % 5 > 2};
    cpu->render(list, camera, {kernel, finish}, shading, a.target());
    gl->render(list, camera, {kernel, finish}, shading, b.target());
    size_t colours = 0, depths = 0;
    for (size_t i = 0; i < a.colour.size(); ++i) {
      colours += !same_colour(a.colour[i], b.colour[i], kernel);
      depths += !(a.depth_m[i] == b.depth_m[i] || std::abs(a.depth_m[i] - b.depth_m[i]) < 1e-4f * a.depth_m[i]);
    }
    // Stated tolerance: at most 0.5 % of pixels show another point, where depths are equal (ewa: another mean);
    // antialiasing spreads that to the neighbours.
    const size_t limit = a.colour.size() / (finish.antialias ? 50 : 200);
    EXPECT_LE(colours, limit) << "frame " << frame;
    EXPECT_LE(depths, limit) << "frame " << frame;
    most[static_cast<size_t>(kernel)] =
        std::max(most[static_cast<size_t>(kernel)], double(colours) / double(a.colour.size()));
  }
  for (const splat::Kernel kernel : splat::kKernels)
    std::printf("%s: at most %.4f of a frame's pixels differ\n", std::string(splat::kernel_name(kernel)).c_str(),
                most[static_cast<size_t>(kernel)]);
}

TEST(MakeRenderer, NamesAndRefusals) {
  const auto cpu = viewer::make_renderer("cpu", 1);
  ASSERT_TRUE(cpu);
  EXPECT_STREQ((*cpu)->name(), "cpu");
  EXPECT_TRUE(viewer::make_renderer("auto", 1));
  const auto none = viewer::make_renderer("raytraced", 1);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().text.find("raytraced"), std::string::npos);
}

}  // namespace
}  // namespace telesplat
