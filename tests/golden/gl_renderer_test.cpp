// Tests of the GL renderer alone: limits of the GPU, and ways to move data that must make no difference.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "client/viewer/render/gl/gl_renderer.h"
#include "common/splat/finish.h"
#include "tests/support/splat_scene.h"
#include "tests/support/splat_surfel_plain.h"

namespace telesplat {
namespace {

using viewer::GlRenderer;

constexpr splat::Finish kNoFinish{false, false, false};

// The same points in every test; the size, and with it the amount of data, varies from frame to frame.
struct Scene {
  explicit Scene(int frame = 0)
      : camera(testing::front_camera(frame % 3 == 2 ? 75 : 150, frame % 3 == 2 ? 60 : 100)),
        shading({}, camera),
        points(testing::random_items(static_cast<uint32_t>(frame), 4 << frame, 120)) {
    for (auto& p : points) {
      splat::DrawItem item = p.item(1.0f + 0.6f * float(items.size() % 14));
      item.radius_m = 0.004f * float(items.size() % 9);
      items.push_back(item);
    }
    list = testing::draw_list(items);
  }
  geometry::Camera camera;
  image::Shading shading;
  std::vector<testing::HandMadeItem> points;
  std::vector<splat::DrawItem> items;
  splat::DrawList list;
};

testing::Frame render(viewer::Renderer& renderer, const Scene& scene, const splat::RenderOptions& options) {
  testing::Frame frame(scene.camera.width, scene.camera.height);
  renderer.render(scene.list, scene.camera, options, scene.shading, frame.target());
  return frame;
}

std::unique_ptr<GlRenderer> made(Result<std::unique_ptr<GlRenderer>> renderer) {
  if (renderer) return std::move(*renderer);
  ADD_FAILURE() << renderer.error().text;
  return nullptr;
}

class GlRendererTest : public ::testing::Test {
 protected:
  // Skips on machines without any OpenGL; fails if a renderer cannot be made with OpenGL.
  void SetUp() override {
    auto context = gl::EglContext::make();
    if (!context) GTEST_SKIP() << context.error().text;
    context_ = std::move(*context);
  }
  std::unique_ptr<gl::EglContext> context_;
};

TEST_F(GlRendererTest, WaysToMoveDataMakeNoDifference) {
  const auto plain = made(GlRenderer::make(false));
  const auto mapped = made(GlRenderer::make(true));
  ASSERT_TRUE(plain && mapped);
  for (int frame = 0; frame < 8; ++frame) {  // frames grow
    const Scene scene(frame);
    const splat::RenderOptions options{splat::kKernels[static_cast<size_t>(frame) % std::size(splat::kKernels)],
                                       {frame % 2 == 0, true, frame % 3 == 0}};
    const testing::Frame a = render(*plain, scene, options), b = render(*mapped, scene, options);
    EXPECT_TRUE(a == b) << "frame " << frame;
    EXPECT_NE(a.colour, std::vector<uint32_t>(a.colour.size(), a.colour[0])) << "nothing drawn in frame " << frame;
  }
}

// Frames of one renderer do not show through in later ones.
TEST_F(GlRendererTest, FramesDoNotDependOnTheOnesBefore) {
  const auto worn = made(GlRenderer::make());
  ASSERT_TRUE(worn);
  for (int frame = 0; frame < 4; ++frame)
    for (const splat::Kernel kernel : splat::kKernels) {
      const auto fresh = made(GlRenderer::make());
      ASSERT_TRUE(fresh);
      const Scene scene(frame);
      const splat::RenderOptions options{kernel, {}};
      EXPECT_TRUE(render(*worn, scene, options) == render(*fresh, scene, options))
          << splat::kernel_name(kernel) << " " << frame;
    }
}

// A new packer numbers its events from 1 again, and memory comes back at the same address.
TEST_F(GlRendererTest, PointsOfAnotherReplicaAreNotTakenForThoseKept) {
  const auto worn = made(GlRenderer::make()), fresh = made(GlRenderer::make());
  ASSERT_TRUE(worn && fresh);
  const geometry::Camera camera = testing::front_camera(64, 48);
  const std::vector<uint16_t> position(4, 32768), normal(4, image::encode_normal16({0, 0, 1}));
  std::vector<uint32_t> colour(4, 0xff0000);
  points::Cluster cluster{5, {{-0.2f, -0.2f, -1.2f}, {0.2f, 0.2f, -0.8f}}, {}};
  splat::DrawList list = testing::draw_list(
      {{&cluster, {4, position.data(), position.data(), position.data(), normal.data(), colour.data()}, 8.0f, {1}}});
  const image::Shading shading = testing::unlit(camera);
  const auto draw = [&](viewer::Renderer& renderer) {
    testing::Frame frame(camera.width, camera.height);
    renderer.render(list, camera, splat::RenderOptions{splat::Kernel::kSquare, kNoFinish}, shading, frame.target());
    return frame;
  };
  list.replica = 1;
  const testing::Frame red = draw(*worn);
  std::fill(colour.begin(), colour.end(), 0x00ff00);
  list.replica = 2;
  const testing::Frame green = draw(*worn);
  EXPECT_NE(red.at(32, 24), green.at(32, 24));
  EXPECT_TRUE(green == draw(*fresh));
}

TEST_F(GlRendererTest, StagesThatAreOffTakeNoTime) {
  const auto renderer = made(GlRenderer::make());
  ASSERT_TRUE(renderer);
  const Scene scene(3);
  testing::Frame frame(scene.camera.width, scene.camera.height);
  const auto stats = [&](const splat::Finish& finish) {
    return renderer->render(scene.list, scene.camera, {splat::Kernel::kDisc, finish}, scene.shading, frame.target());
  };
  stats({});
  const splat::SplatStats off = stats(kNoFinish);
  EXPECT_EQ(off.fill_ms, 0.0);
  EXPECT_EQ(off.smooth_ms, 0.0);
  EXPECT_EQ(off.antialias_ms, 0.0);
  EXPECT_GT(off.project_ms, 0.0);
  EXPECT_EQ(off.points_drawn, scene.list.points);
  EXPECT_EQ(stats({true, false, false}).antialias_ms, 0.0);
}

TEST_F(GlRendererTest, RefusesWhatTheGpuCannotHold) {
  const auto renderer = made(GlRenderer::make());
  ASSERT_TRUE(renderer);
  GLint limit = 0;
  {
    const gl::EglContext::Current current(*context_);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
  }
  Scene scene;
  scene.camera = testing::front_camera(limit, 2);
  const testing::Frame shown = render(*renderer, scene, {});
  EXPECT_EQ(shown.colour, std::vector<uint32_t>(shown.colour.size(), 0xff000000u | scene.shading.background()));
  EXPECT_TRUE(std::isinf(shown.depth_m.front()) && std::isinf(shown.depth_m.back()));
  // The renderer goes on with frames that it can draw.
  const Scene small;
  const testing::Frame after = render(*renderer, small, {});
  EXPECT_NE(after.colour, std::vector<uint32_t>(after.colour.size(), after.colour[0]));
}

// ---- the finish, against the CPU's stages on plainly splatted ellipses ----

constexpr int kMargin = 24;  // pixels around the image that the stages may look at

// testing::ellipse_plainly, for the image and a margin around it.
std::vector<uint64_t> keys_with_margin(const Scene& scene) {
  const int width = scene.camera.width + 2 * kMargin, height = scene.camera.height + 2 * kMargin;
  std::vector<uint64_t> keys(size_t(width) * size_t(height), uint64_t(splat::kEmptyKey));
  const auto near_m = static_cast<float>(scene.camera.near_m);
  const splat::SpacingLimits limits = splat::spacing_limits(scene.list.scale);
  testing::for_surfels(
      scene.list, scene.camera,
      [&](const splat::DrawItem& item, uint32_t i, const splat::SurfelSource& source, float x, float y, float w,
          const splat::SurfelContour& contour) {
        const splat::SurfelConic c = splat::surfel_conic(contour, x, y, 1.0f, splat::kOpaqueVariance);
        const splat::SurfelDepth depth = splat::surfel_depth(contour, w, near_m);
        const float bias = splat::ellipse_bias(source.radius_m, w);
        const uint32_t spacing = splat::surfel_spacing(contour.xx * contour.yy - contour.xy * contour.xy, limits);
        const int middle_x = int(std::floor(c.centre_x)), middle_y = int(std::floor(c.centre_y));
        const auto visit = [&](int px, int py, bool always) {
          const int column = px + kMargin, row = py + kMargin;
          if (column < 0 || row < 0 || column >= width || row >= height) return;
          const float dx = (float(px) + 0.5f) - c.centre_x, dy = (float(py) + 0.5f) - c.centre_y, q = c.at(dx, dy);
          if (q > 1.0f && !always) return;
          const float code = ((depth.centre + depth.x * dx) + depth.y * dy) + bias * std::min(q, 1.0f);
          const uint64_t key = splat::encode_key(uint32_t(std::clamp(code, 0.0f, float(splat::kMaxDepthCode))), spacing,
                                                 uint32_t(std::min(8.0f * q, 7.0f)), item.level.normal[i],
                                                 item.level.colour[i] & 0xffffff);
          uint64_t& there = keys[size_t(row) * size_t(width) + size_t(column)];
          there = uint64_t(std::min(int64_t(there), int64_t(key)));
        };
        for (int py = c.y0; py < c.y1; ++py)
          for (int px = c.x0; px < c.x1; ++px) visit(px, py, false);
        visit(middle_x, middle_y, true);
      });
  return keys;
}

std::vector<uint32_t> finish_plainly(const Scene& scene, const splat::Finish& finish) {
  const int width = scene.camera.width, height = scene.camera.height, stride = width + 2 * kMargin;
  const std::vector<uint64_t> keys = keys_with_margin(scene);
  std::vector<uint32_t> rows(2 * keys.size() + 64);
  for (size_t i = 0; i < keys.size(); ++i) {
    const size_t at =
        i / static_cast<size_t>(stride) * 2 * static_cast<size_t>(stride) + i % static_cast<size_t>(stride);
    const bool empty = static_cast<int64_t>(keys[i]) == splat::kEmptyKey;
    rows[at] =
        empty ? scene.shading.background()
              : image::Shading::apply(splat::key_albedo(keys[i]), scene.shading.table()[splat::key_normal(keys[i])]);
    rows[at + static_cast<size_t>(stride)] = empty ? splat::kEmptyInfo : splat::key_info(keys[i]);
  }
  const splat::ResolvedTile tile{rows.data(), stride, kMargin, width, height};
  splat::FinishScratch scratch;
  int grow = splat::finish_reach(finish);
  if (finish.fill) splat::fill_holes(tile, grow -= splat::kFillReach, splat::gaps_to_fill(finish), scratch);
  if (finish.smooth) splat::smooth(tile, grow -= 1, scratch);
  if (finish.antialias) splat::antialias(tile, scratch);
  std::vector<uint32_t> out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) out.push_back(0xff000000u | tile.colour(y)[x]);
  return out;
}

TEST_F(GlRendererTest, FinishesAsTheCpuDoes) {
  const auto renderer = made(GlRenderer::make());
  ASSERT_TRUE(renderer);
  const Scene scene(4);
  const std::vector<uint32_t> unfinished = finish_plainly(scene, kNoFinish);
  for (const splat::Finish& finish : {kNoFinish, splat::Finish{true, false, false}, splat::Finish{false, true, false},
                                      splat::Finish{false, false, true}, splat::Finish{}}) {
    const std::vector<uint32_t> plain = finish_plainly(scene, finish);
    const testing::Frame drawn = render(*renderer, scene, {splat::Kernel::kEllipse, finish});
    size_t differing = 0, changed = 0;
    for (size_t i = 0; i < plain.size(); ++i) {
      differing += plain[i] != drawn.colour[i];
      changed += plain[i] != unfinished[i];
    }
    const std::string what = std::string(finish.fill ? "fill " : "") + (finish.smooth ? "smooth " : "") +
                             (finish.antialias ? "antialias" : "");
    // Where depths are equal another point may win. A stage changes far more than that.
    EXPECT_LE(differing, plain.size() / 200) << what;
    if (what != "") {
      EXPECT_GE(changed, plain.size() / 100) << what;
    }
    std::printf("%s: %zu differ, %zu changed of %zu\n", what.c_str(), differing, changed, plain.size());
  }
}

}  // namespace
}  // namespace telesplat
