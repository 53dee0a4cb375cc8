// The picture of a camera that rests: the order in which its tiles are drawn, and their display.
#include <gtest/gtest.h>

#include <thread>

#include "client/viewer/points/source.h"
#include "common/core/clock.h"
#include "common/scene/clip_order.h"
#include "tests/support/patience.h"
#include "tests/support/still_scene.h"

namespace telesplat::viewer {
namespace {

TEST(BoxFilter, TakesTheRoundedMeanOfEachChannel) {
  const uint32_t from[] = {0x000000, 0x010203, 0xffffff, 0x00ff00,  //
                           0x010203, 0x010203, 0xff00ff, 0xffffff};
  uint32_t to[2] = {};
  box_filter(from, 4, 2, {to, 2, 2, 1});
  EXPECT_EQ(to[0], 0xff010202u);  // 3/4, 6/4, 9/4
  EXPECT_EQ(to[1], 0xffbfbfbfu);  // 765/4 = 191.25
  const std::vector<uint32_t> white(16, 0xffffffff);
  box_filter(white.data(), 4, 4, {to, 1, 1, 1});
  EXPECT_EQ(to[0], 0xffffffffu);
}

constexpr int kW = StillPicture::kTileWidth, kH = StillPicture::kTileHeight;

geometry::Camera grid_camera(int columns, int rows) { return geometry::make_camera({}, 90, kW * columns, kH * rows); }

void fill(StillPicture& still, size_t tile, uint32_t colour, int width) {
  const geometry::Rect r = still.rect(tile);
  for (int y = 0; y < r.height; ++y) std::fill_n(still.pixels(tile) + size_t(y) * size_t(width), r.width, colour);
}

TEST(StillPicture, BeginsInTheCentreAndCoversEveryPixelOnce) {
  StillPicture still;
  geometry::Camera camera = grid_camera(3, 3);
  camera.width -= 50, camera.height -= 31;  // tiles at the right and below are smaller
  still.begin(camera);
  std::vector<int> met(size_t(camera.width) * size_t(camera.height));
  double last = 0;
  int tiles = 0;
  while (const auto tile = still.next(1)) {
    const geometry::Rect r = still.rect(*tile);
    const double distance = std::hypot(r.x + (r.width - camera.width) / 2.0, r.y + (r.height - camera.height) / 2.0);
    EXPECT_GE(distance, last);
    last = distance;
    for (int y = r.y; y < r.y + r.height; ++y)
      for (int x = r.x; x < r.x + r.width; ++x) ++met[size_t(y) * size_t(camera.width) + size_t(x)];
    EXPECT_FALSE(still.covers_all());
    still.done(*tile, true, 1);
    ++tiles;
  }
  EXPECT_EQ(tiles, 9);
  EXPECT_TRUE(still.covers_all());
  EXPECT_DOUBLE_EQ(still.share(), 1);
  EXPECT_EQ(std::count(met.begin(), met.end(), 1), std::ptrdiff_t(met.size()));
}

// A box of 2 cm that only one tile sees.
geometry::Box box_at(const geometry::Camera& camera, double x, double y) {
  const glm::vec3 centre(camera.unproject(x, y, 1));
  return {centre - 0.01f, centre + 0.01f};
}

TEST(StillPicture, DrawsAgainWherePointsCameAndKeepsThePixelsUntilThen) {
  const geometry::Camera camera = grid_camera(3, 2);
  StillPicture still;
  still.begin(camera);
  for (size_t i = 0; i < 6; ++i) {
    fill(still, i, uint32_t(i), camera.width);
    still.done(i, true, 1);
  }
  EXPECT_FALSE(still.next(100));
  still.on_changes({true, false, {box_at(camera, 1.5 * kW, 1.5 * kH)}});
  EXPECT_FALSE(still.next(1 + 0.5 * StillPicture::kTileRest_s)) << "it was drawn just before";
  EXPECT_EQ(still.next(2), 4u);
  EXPECT_TRUE(still.covers_all());
  image::View view{camera.width, camera.height, std::vector<uint32_t>(size_t(camera.width * camera.height), 99), {}};
  still.put_over(view);
  EXPECT_EQ(view.colour[size_t(kH) * camera.width + kW], 4u);
  still.done(4, false, 3);
  EXPECT_FALSE(still.covers_all());
  EXPECT_NEAR(still.share(), 5.0 / 6, 1e-9);
  EXPECT_FALSE(still.next(100));
}

TEST(StillPicture, DrawsAgainWhereRaysAreKnown) {
  StillPicture still;
  const geometry::Camera camera = grid_camera(3, 2);
  still.begin(camera);
  while (const auto tile = still.next(1)) still.done(*tile, true, 1);
  const geometry::Rect rects[] = {{kW + 5, kH + 5, 10, 10}, {2 * kW, 3, 4, 4}, {0, 0, 0, 0}};
  still.on_changes(std::span(rects).first(1));
  EXPECT_EQ(still.next(2), std::optional<size_t>(4));
  still.done(4, true, 2);
  EXPECT_FALSE(still.next(3));
  still.on_changes(std::span(rects).subspan(1, 1));
  std::vector<size_t> drawn;
  while (const auto tile = still.next(4)) drawn.push_back(*tile), still.done(*tile, true, 4);
  std::sort(drawn.begin(), drawn.end());
  EXPECT_EQ(drawn, (std::vector<size_t>{1, 2})) << "what lies at a tile's rim is seen in the next one, too";
}

TEST(StillPicture, ChangesBesideTheViewAreNone) {
  const geometry::Camera camera = grid_camera(2, 2);
  StillPicture still;
  still.begin(camera);
  for (size_t i = 0; i < 4; ++i) still.done(i, true, 1);
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  still.on_changes({true,
                    false,
                    {box_at(camera, -500, 10),
                     box_at(camera, 10, 5000),
                     {{-1, -1, 3}, {1, 1, 4}},  // behind the eye
                     {{nan, 0, -1}, {nan, 0, -1}}}});
  EXPECT_FALSE(still.next(100));
  // A box around the eye may be seen anywhere. Infinite ones crash nothing.
  still.on_changes({true, false, {{{-1, -1, -1}, {1, 1, 1}}, {{-inf, -inf, -inf}, {inf, inf, inf}}}});
  int wanted = 0;
  for (; const auto tile = still.next(100); ++wanted) still.done(*tile, true, 100);
  EXPECT_EQ(wanted, 4);
}

TEST(StillPicture, AnotherSceneLeavesNothingOfTheOneBefore) {
  StillPicture still;
  still.begin(grid_camera(2, 1));
  for (size_t i = 0; i < 2; ++i) still.done(i, true, 1);
  still.on_changes({true, true, {}});
  EXPECT_EQ(still.share(), 0);
  EXPECT_TRUE(still.next(1)) << "without waiting";
}

TEST(ModelCacheChanges, TellWhereAndOnce) {
  ModelCache cache;
  ModelCache::Changes changes;
  const points::ModelConfig config = test::scene_config();
  cache.begin_replica(config, EpochId{1});
  cache.take_changes(changes);
  EXPECT_TRUE(changes.any && changes.everywhere);
  const geometry::Camera camera = test::scene_camera({0.3, 0.3, 0.6}, 64, 40);
  auto patch = test::whole_patch(config, 1, camera, 1);
  std::vector<points::ClusterKey> keys;
  for (const auto& [key, mosaic] : patch.mosaics) keys.push_back(key);
  cache.insert(std::move(patch), EpochId{1});
  cache.take_changes(changes);
  EXPECT_TRUE(changes.any);
  EXPECT_FALSE(changes.everywhere);
  ASSERT_EQ(changes.boxes.size(), keys.size());
  EXPECT_EQ(changes.boxes.front(), points::leaf_box(config, keys.front()));
  cache.take_changes(changes);
  EXPECT_FALSE(changes.any || changes.everywhere);
  EXPECT_TRUE(changes.boxes.empty());
  cache.forget(Sequence{2}, std::span(keys).first(3));
  cache.take_changes(changes);
  EXPECT_EQ(changes.boxes.size(), 3u);
  // A new epoch grows behind the one on display, then takes its place.
  cache.begin_replica(config, EpochId{2});
  cache.take_changes(changes);
  EXPECT_FALSE(changes.everywhere);
  cache.show_newest();
  cache.take_changes(changes);
  EXPECT_TRUE(changes.everywhere);
  cache.show_newest();
  cache.take_changes(changes);
  EXPECT_FALSE(changes.any);
}

TEST(ModelCacheChanges, DoNotGrowWithoutEndWhereNobodyTakesThem) {
  ModelCache cache;
  const points::ModelConfig config = test::scene_config(8);
  cache.begin_replica(config, EpochId{1});
  ModelCache::Changes changes;
  cache.take_changes(changes);
  const geometry::Camera camera = test::scene_camera({0.3, 0.3, 0.6}, 160, 100);
  size_t told = 0;
  for (uint64_t i = 1; told < (1u << 16); ++i) {
    auto patch = test::whole_patch(config, i, camera, 1);
    told += patch.mosaics.size();
    cache.insert(std::move(patch), EpochId{1});
  }
  cache.insert(test::whole_patch(config, 1000, camera, 1), EpochId{1});
  cache.take_changes(changes);
  EXPECT_TRUE(changes.everywhere);
  EXPECT_TRUE(changes.boxes.empty());
}

// Counts the frames that it draws.
class CountingRenderer final : public Renderer {
 public:
  explicit CountingRenderer(int& frames) : frames_(frames), renderer_(make_cpu_renderer(2)) {}
  const char* name() const override { return "cpu"; }
  splat::SplatStats render(const splat::DrawList& list, const geometry::Camera& camera,
                           const splat::RenderOptions& options, const image::Shading& shading,
                           const splat::FrameTarget& target) override {
    ++frames_;
    return renderer_->render(list, camera, options, shading, target);
  }

 private:
  int& frames_;
  std::unique_ptr<Renderer> renderer_;
};

class StillSource : public testing::Test {
 protected:
  StillSource() : received_({}, links()) {
    wire::Welcome w;
    w.octree_depth = 6;
    w.box_room = config_.box_room;
    EXPECT_TRUE(received_.follow(w).ok());
    config_.compact = true;
    received_.cache().begin_replica(config_, EpochId{1});
    options_.target_fps = 30;
    source_ = std::make_unique<PointSource>(options_, std::make_unique<CountingRenderer>(renders_), received_);
    insert(1);
  }
  ReceivedLinks links() {
    return {.viewer = {5},
            .gate = gate_,
            .feeds = feeds_,
            .spans = spans_,
            .on_part = [](const ViewPart&) {},
            .on_epoch = [] {},
            .requested_s = [](RequestId) { return std::nullopt; },
            .to_master_s = [](double s) { return s; }};
  }
  void insert(int by) {
    const test::CastRays rays = test::cast_rays(camera_, by, [](int, int) { return true; });
    received_.fine_rays().add(rays.tile(EpochId{1}));
    received_.cache().insert(rays.patch(config_, ++sequence_), EpochId{1});
  }
  DrawnFrame frame(bool intact = true) {
    view_.width = camera_.width, view_.height = camera_.height;
    view_.colour.resize(size_t(camera_.width) * size_t(camera_.height));
    view_.depth_m.resize(view_.colour.size());
    return source_->draw({.begin_s = monotonic_s(), .camera = camera_, .look = look_, .intact = intact}, view_);
  }
  // Draws until no frame changes any more; returns the last one.
  DrawnFrame settle() {
    DrawnFrame f = frame();
    int unchanged = 0;
    for (int i = 0; i < 5000 && unchanged < 200; ++i) {
      f = frame();
      unchanged = f.changed ? 0 : unchanged + 1;
      if (!f.changed) std::this_thread::sleep_for(std::chrono::duration<double>(test::patient(0.002)));
    }
    EXPECT_EQ(unchanged, 200);
    return f;
  }

  net::Context context_;
  CouplingGate gate_{0};
  Feeds feeds_{context_, "viewer"};
  metrics::SpanRecorder spans_;
  points::ModelConfig config_ = test::scene_config();
  ReceivedPoints received_;
  geometry::Camera camera_ = test::scene_camera({0.3, 0.3, 0.5}, 320, 200);
  DisplayOptions options_;
  Look look_;
  int renders_ = 0;
  std::unique_ptr<PointSource> source_;
  uint64_t sequence_ = 0;
  image::View view_;
};

TEST_F(StillSource, ConvergesToSixteenRaysAPixelAndThenDrawsNothing) {
  const image::View reference = test::traced(camera_, 4, image::Shading(options_.shading, camera_));
  frame(false);
  const double moving = test::psnr_db(view_, reference);
  settle();
  insert(2);
  settle();
  insert(4);
  const DrawnFrame last = settle();
  EXPECT_DOUBLE_EQ(last.refined.share, 1);
  const double still = test::psnr_db(view_, reference);
  std::printf("moving %.2f dB, still %.2f dB\n", moving, still);
  EXPECT_GT(still, 42);
  EXPECT_GT(still, moving + 5);
  const int before = renders_;
  const auto picture = view_.colour;
  const DrawnFrame stands = frame();
  EXPECT_FALSE(stands.changed);
  EXPECT_TRUE(stands.still);
  EXPECT_EQ(renders_, before);
  // A view whose pixels were overwritten is filled again, without drawing.
  std::fill(view_.colour.begin(), view_.colour.end(), 7u);
  const DrawnFrame filled = frame(false);
  EXPECT_TRUE(filled.changed);
  EXPECT_TRUE(filled.still) << "it is the picture of before";
  EXPECT_EQ(renders_, before);
  EXPECT_EQ(view_.colour, picture);
}

TEST_F(StillSource, MovementEndsIt) {
  insert(4);
  ASSERT_GT(settle().refined.share, 0);
  camera_.pose.position_room.x += 0.001;
  const int before = renders_;
  const DrawnFrame moved = frame();
  EXPECT_TRUE(moved.changed);
  EXPECT_FALSE(moved.still);
  EXPECT_EQ(moved.refined.share, 0);
  EXPECT_EQ(renders_, before + 1) << "a frame of a moving head is drawn once, without sub-pixels";
}

TEST_F(StillSource, NewPointsAreShown) {
  settle();
  const auto before = view_.colour;
  received_.cache().forget(Sequence{++sequence_}, std::vector<points::ClusterKey>{});
  settle();
  EXPECT_EQ(view_.colour, before) << "an event without points changes nothing";
  insert(4);
  settle();
  EXPECT_NE(view_.colour, before);
  // All points are forgotten: only the background is left.
  std::vector<points::ClusterKey> keys;
  for (uint32_t x = 0; x < 64; ++x)
    for (uint32_t y = 0; y < 64; ++y)
      for (uint32_t z = 0; z < 64; ++z) keys.push_back(x | y << 10 | z << 20);
  received_.cache().forget(Sequence{++sequence_}, keys);
  const DrawnFrame empty = settle();
  EXPECT_TRUE(empty.empty);
  const auto background = std::count_if(view_.colour.begin(), view_.colour.end(),
                                        [&](uint32_t c) { return (c & 0xffffff) == options_.shading.background; });
  EXPECT_EQ(background, std::ptrdiff_t(view_.colour.size()));
}

TEST_F(StillSource, AFrameNeverShowsTwoEpochs) {
  insert(4);
  ASSERT_GT(settle().refined.share, 0);
  received_.cache().begin_replica(config_, EpochId{2});
  received_.cache().show_newest();
  const DrawnFrame f = frame();
  EXPECT_EQ(f.epoch, EpochId{2});
  EXPECT_TRUE(f.empty);
  for (const uint32_t c : view_.colour) ASSERT_EQ(c & 0xffffff, options_.shading.background);
}

// However long the epoch with the session's clip takes, and with any epoch on display in the meantime.
TEST_F(StillSource, FramesBetweenTwoClipsAreToldUntilTheirEpochIsShown) {
  EXPECT_FALSE(frame().between_clips);
  const auto show = [&](uint64_t epoch) {
    received_.cache().begin_replica(config_, EpochId{epoch});
    received_.cache().show_newest();
  };
  const auto clip = [&](uint64_t epoch, const std::string& planes) {
    wire::Welcome w;
    w.octree_depth = 6;
    w.box_room = config_.box_room;
    w.epoch = EpochId{epoch};
    w.facts[scene::kClipFact] = planes;
    EXPECT_TRUE(received_.follow(w).ok());
  };
  clip(3, "1 0 0 0");
  EXPECT_TRUE(frame().between_clips);
  show(2);
  EXPECT_TRUE(frame().between_clips);
  show(3);
  EXPECT_FALSE(frame().between_clips);
  clip(4, "1 0 0 0");  // another epoch, with the same clip
  EXPECT_FALSE(frame().between_clips);
  // The epoch's points may come before its welcome.
  show(5);
  clip(5, "");
  EXPECT_FALSE(frame().between_clips);
}

TEST_F(StillSource, WithoutAntialiasingAndWithOneSampleAllFramesAreDrawnAlike) {
  look_.render.finish.antialias = false;
  insert(4);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(frame().refined.share, 0);
  EXPECT_EQ(renders_, 20);
  look_.render.finish.antialias = true;
  options_.still_samples = 1;
  source_ = std::make_unique<PointSource>(options_, std::make_unique<CountingRenderer>(renders_), received_);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(frame().refined.share, 0);
  EXPECT_EQ(renders_, 40);
}

}  // namespace
}  // namespace telesplat::viewer
