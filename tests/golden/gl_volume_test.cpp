// Both renderers of volumes show the same picture. A failure keeps the CPU's picture, GL's and their difference.
#include <gtest/gtest.h>

#include <filesystem>

#include "client/viewer/render/renderer.h"
#include "common/gl/egl_context.h"
#include "common/image/file.h"
#include "tests/support/volume/frames.h"

namespace telesplat {
namespace {

using testing::blob_frame, testing::difference, testing::looking_at, testing::orbit, testing::turned_grid;
using testing::WarpedView;

constexpr uint32_t kBackground = 0x203040;

class GlVolumeTest : public ::testing::Test {
 protected:
  // Skips on machines without any OpenGL; fails if a renderer cannot be made with OpenGL.
  void SetUp() override {
    if (const auto context = gl::EglContext::make(); !context) GTEST_SKIP() << context.error().text;
    auto made = viewer::make_volume_renderer("gl", 1);
    ASSERT_TRUE(made) << made.error().text;
    gl_ = std::move(*made);
  }

  void expect_alike(const volume::VolumeFrame* frame, const geometry::Camera& camera, const std::string& what) {
    WarpedView cpu(camera), gl(camera);
    cpu_->render(frame, camera, kBackground, cpu.target());
    gl_->render(frame, camera, kBackground, gl.target());
    image::View apart{camera.width, camera.height, {}, {}};
    int most = 0, depths_off = 0;
    double sum = 0;
    for (size_t i = 0; i < cpu.colour.size(); ++i) {
      const int d = difference(cpu.colour[i], gl.colour[i]);
      most = std::max(most, d), sum += d;
      apart.colour.push_back(static_cast<uint32_t>(std::min(32 * d, 255)) * 0x010101u);
      const float a = cpu.depth_m[i], b = gl.depth_m[i];
      depths_off += !(a == b || std::abs(a - b) < 1e-4f);
    }
    EXPECT_LE(most, 4) << what;
    // GL may round each look-up to eight bits, and llvmpipe does.
    EXPECT_LT(sum / static_cast<double>(cpu.colour.size()), 0.75) << what;
    // By rounding alone, opacity may reach kSolid a layer earlier or later.
    EXPECT_LT(depths_off, 1 + static_cast<int>(cpu.colour.size()) / 200) << what;
    const char* keep = std::getenv("TELESPLAT_KEEP_IMAGES");
    if (!HasFailure() && !keep) return;
    const std::filesystem::path folder = std::filesystem::path(TELESPLAT_GOLDEN_OUT) / "golden-failures";
    std::filesystem::create_directories(folder);
    for (const auto& [name, colour] :
         {std::pair{"cpu", &cpu.colour}, {"gl", &gl.colour}, {"difference", &apart.colour}})
      EXPECT_TRUE(image::write_png((folder / ("volume-" + what + "-" + name + ".png")).string(),
                                   {camera.width, camera.height, *colour, {}}));
  }

  std::unique_ptr<viewer::VolumeRenderer> cpu_ = viewer::make_cpu_volume_renderer(1), gl_;
};

TEST_F(GlVolumeTest, ShowsWhatTheCpuShows) {
  const volume::Grid grid = turned_grid();
  for (int n = 0; n < 6; ++n) {
    const double around = 1.1 * n, above = 0.4 * std::sin(2.0 * n);
    const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.8, around, above), 320, 240);
    volume::VolumeFrame frame = blob_frame(grid, sampled);
    // Two frames of one number are one frame: give each its own, since texels may lie where the last ones did.
    frame.frame = FrameId{static_cast<uint64_t>(n + 1)};
    const auto display = looking_at(grid.centre_room(), orbit(grid, 0.7, around + 0.12, above + 0.06), 300 + n, 220);
    expect_alike(&frame, display, "aside-" + std::to_string(n));
    expect_alike(&frame, looking_at(grid.centre_room(), orbit(grid, 0.8, around + 3.2, above), 300, 220),
                 "behind-" + std::to_string(n));
  }
}

TEST_F(GlVolumeTest, ShowsEachFrameAfterTheOtherAndNothing) {
  const volume::Grid grid = turned_grid();
  const auto camera = looking_at(grid.centre_room(), orbit(grid, 0.8, 0.3, 0.2), 200, 150);
  // Frames differ in size and number of layers, and use the same place in memory.
  for (int n = 0; n < 4; ++n) {
    const auto sampled = looking_at(grid.centre_room(), orbit(grid, 0.8, 0.3, 0.2), n % 2 ? 90 : 320, n % 2 ? 70 : 240);
    volume::VolumeFrame frame = blob_frame(grid, sampled, n == 2 ? 64 : 5 + n);
    frame.frame = FrameId{static_cast<uint64_t>(n + 1)};
    expect_alike(&frame, camera, "frame-" + std::to_string(n));
    expect_alike(nullptr, camera, "nothing-" + std::to_string(n));
    expect_alike(&frame, camera, "again-" + std::to_string(n));
  }
  const volume::VolumeFrame empty =
      testing::frame_of(grid, volume::plan_frame(grid, std::span(&camera, 1)).value(), {});
  expect_alike(&empty, camera, "empty");
}

TEST(VolumeRenderer, IsMadeByName) {
  EXPECT_STREQ(viewer::make_volume_renderer("cpu", 1).value()->name(), "cpu");
  EXPECT_TRUE(viewer::make_volume_renderer("auto", 1));
  const auto unknown = viewer::make_volume_renderer("vulkan", 1);
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().text.find("vulkan"), std::string::npos);
}

}  // namespace
}  // namespace telesplat
