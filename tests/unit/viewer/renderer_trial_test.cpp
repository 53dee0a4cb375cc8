// The trial of two renderers: a session keeps the quicker one.
#include "client/viewer/render/renderer_trial.h"

#include <gtest/gtest.h>

#include "client/viewer/render/renderer.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kPixels = 1280 * 800;

// Draws frames at 50 a second until the trial ends; renderer i takes ms[i]. Returns the number of frames, at most 500.
size_t frames_of_trial(RendererTrial& trial, std::array<double, 2> ms) {
  size_t frames = 0;
  for (; !trial.quicker() && frames < 500; ++frames) trial.add(kPixels, ms[trial.next()], 10 + 0.02 * double(frames));
  return frames;
}

TEST(RendererTrial, KeepsTheQuickerRenderer) {
  for (const bool gl : {false, true}) {
    RendererTrial trial;
    frames_of_trial(trial, gl ? std::array{12.0, 9.0} : std::array{9.0, 12.0});
    ASSERT_TRUE(trial.quicker());
    EXPECT_EQ(*trial.quicker(), gl ? 1U : 0U);
    EXPECT_EQ(trial.median_ms(0), gl ? 12 : 9);
  }
}

TEST(RendererTrial, LastsASecondWhereTheTwoAreClose) {
  RendererTrial trial;
  const size_t frames = frames_of_trial(trial, {10, 11});
  EXPECT_NEAR(double(frames), 51, 2);  // a second of 20 ms a frame
}

TEST(RendererTrial, EndsAfterFewFramesWhereOneIsFarSlower) {
  RendererTrial trial;
  EXPECT_EQ(frames_of_trial(trial, {5, 130}), 2 * (RendererTrial::kWarmUp + RendererTrial::kFew));
  EXPECT_EQ(*trial.quicker(), 0U);
}

TEST(RendererTrial, DrawsByTurns) {
  RendererTrial trial;
  std::array<int, 2> drawn{};
  for (int i = 0; i < 20; ++i) {
    ++drawn[trial.next()];
    trial.add(kPixels, 10, 10 + 0.01 * i);
  }
  EXPECT_EQ(drawn[0], 10);
  EXPECT_EQ(drawn[1], 10);
}

// A renderer's first frames upload points and compile shaders.
TEST(RendererTrial, LeavesTheFirstFramesOut) {
  RendererTrial trial;
  std::array<int, 2> drawn{};
  for (int i = 0; i < 500 && !trial.quicker(); ++i) {
    const size_t by = trial.next();
    const double ms = by == 0 ? 10 : drawn[by] < int(RendererTrial::kWarmUp) ? 900 : 6;
    ++drawn[by];
    trial.add(kPixels, ms, 10 + 0.02 * i);
  }
  ASSERT_TRUE(trial.quicker());
  EXPECT_EQ(*trial.quicker(), 1U);
}

TEST(RendererTrial, CountsFramesOfTheLargestSizeAlone) {
  // A window grows, and there the other renderer is quicker. Between its frames, parts of frames are drawn.
  RendererTrial grown;
  for (int i = 0; i < 8; ++i) grown.add(kPixels / 4, grown.next() == 0 ? 5 : 6, 10 + 0.01 * i);
  double now_s = 11;
  for (; !grown.quicker() && now_s < 20; now_s += 0.02) {
    grown.add(kPixels, grown.next() == 0 ? 12 : 8, now_s);
    grown.add(kPixels / 16, 0.1, now_s);
  }
  ASSERT_TRUE(grown.quicker());
  EXPECT_EQ(*grown.quicker(), 1U);
  EXPECT_EQ(grown.median_ms(0), 12);
  EXPECT_EQ(grown.median_ms(1), 8);
}

// Each frame takes ms on the test's clock.
class SlowRenderer final : public Renderer {
 public:
  struct Test {
    double now_s = 10;
    int alive = 0;
  };
  SlowRenderer(const char* name, double ms, Test& test) : name_(name), ms_(ms), test_(test) { ++test_.alive; }
  ~SlowRenderer() override { --test_.alive; }
  const char* name() const override { return name_; }
  bool halves() const override { return name_ == std::string("cpu"); }
  splat::SplatStats render(const splat::DrawList&, const geometry::Camera&, const splat::RenderOptions&,
                           const image::Shading&, const splat::FrameTarget&) override {
    test_.now_s += ms_ / 1e3;
    return {};
  }

 private:
  const char* name_;
  double ms_;
  Test& test_;
};

TEST(TriedRenderer, DrawsWithTheOneThatIsKeptAndDropsTheOther) {
  SlowRenderer::Test test;
  const auto choice = std::make_shared<RendererChoice>();
  const auto tried = try_renderers(std::make_unique<SlowRenderer>("cpu", 3, test),
                                   std::make_unique<SlowRenderer>("gl", 15, test), choice, [&] { return test.now_s; });
  EXPECT_STREQ(tried->name(), "auto");
  EXPECT_FALSE(tried->halves());
  splat::DrawList list;
  geometry::Camera camera;
  camera.width = 64, camera.height = 48;
  const image::Shading shading({}, camera);
  const splat::FrameTarget target{64, 48, nullptr, nullptr};
  const auto draw = [&] { tried->render(list, camera, splat::RenderOptions{}, shading, target); };
  for (int i = 0; i < 20; ++i) draw();  // an empty picture does not count
  EXPECT_EQ(choice->get().kept, "");
  list.points = 1;
  for (size_t i = 0; i < 2 * (RendererTrial::kWarmUp + RendererTrial::kFew); ++i) draw();
  EXPECT_EQ(choice->get().kept, "cpu");
  EXPECT_NEAR(choice->get().cpu_ms, 3, 1e-6);
  EXPECT_NEAR(choice->get().gl_ms, 15, 1e-6);
  EXPECT_EQ(test.alive, 1);
  EXPECT_STREQ(tried->name(), "cpu");
  EXPECT_TRUE(tried->halves());
  const double before_s = test.now_s;
  for (int i = 0; i < 10; ++i) draw();
  EXPECT_NEAR(test.now_s - before_s, 0.03, 1e-6);
}

}  // namespace
}  // namespace telesplat::viewer
