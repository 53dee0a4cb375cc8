// Plans and their results: an analytic scene is sampled only by plans.
#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "services/packer/points/plan/planner.h"
#include "services/packer/points/plan/view/view_map.h"
#include "tests/support/packer_scenes.h"
#include "tests/support/planned_tiles.h"

namespace telesplat::packer {
namespace {

PlanConfig plan_config() {
  PlanConfig c;
  c.model = test::packer_config().model;
  return c;
}

// A packer with its planner, and a sampler that casts the planned rays.
struct Session {
  explicit Session(const PlanConfig& config = plan_config()) : planner(config) { core.watch(&planner); }

  wire::PlanRequest request(const geometry::Camera& camera, bool extra = false, uint64_t round = 0) {
    return {.frame = {++frame},
            .epoch = test::kEpoch,
            .viewer = {77},
            .request = {frame},
            .camera = camera,
            .extra = extra,
            .round = round,
            .tile_size = 64};
  }

  wire::Plan ask(const wire::PlanRequest& r) { return planner.plan(core.model(), core.sequence(), r, now_s += 0.1); }

  // Casts the rays of a plan. Returns their number.
  uint64_t cast(const wire::PlanRequest& r, const wire::Plan& plan) {
    uint64_t rays = 0;
    if (plan.full) {
      for (SampledTile& tile : test::sampled_frame(r.frame, r.camera, 64)) {
        rays += tile.image.pixels();
        tile.viewer = r.viewer, tile.request = r.request;
        submit(std::move(tile), true);
      }
      return rays;
    }
    for (test::PlannedTile& planned : test::planned_tiles(r, plan)) {
      rays += planned.rays;
      submit(std::move(planned.tile), planned.whole);
    }
    return rays;
  }
  void submit(SampledTile tile, bool whole) {
    tile.coarse = coarse;
    planner.take(tile, whole, now_s);
    EXPECT_TRUE(core.submit(std::move(tile), now_s).ok());
    planner.settle();
    for (const Event& forget : core.forget(planner.disproved())) (void)forget, ++forgets;
  }
  uint64_t view(const geometry::Camera& camera) {
    const wire::PlanRequest r = request(camera);
    last = ask(r);
    return cast(r, last);
  }

  PackerCore core{test::packer_config(), test::kEpoch};
  Planner planner;
  wire::Plan last;
  uint64_t frame = 0, forgets = 0;
  double now_s = 0;
  bool coarse = false;  // tiles are sampled from coarser data
};

TEST(Plan, AStillViewNeedsNothingAfterAFewRounds) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 3; ++trial) {
    PlanConfig config = plan_config();
    config.validation = 0;
    Session s(config);
    const geometry::Camera camera = test::scene_camera(test::random_eye(random), 320, 240);
    EXPECT_EQ(s.view(camera), 320u * 240u) << "the first view is sampled whole";
    EXPECT_TRUE(s.last.full);
    uint64_t rays = 0, rounds = 0;
    for (; rounds < 4 && (rounds == 0 || rays > 0); ++rounds) rays = s.view(camera);
    EXPECT_EQ(rays, 0u);
    uint64_t extra = 0;
    for (uint64_t round = 0;; ++round) {
      ASSERT_LT(round, 100u) << "extra rays do not come to an end";
      const wire::PlanRequest r = [&] {
        auto q = s.request(camera, true, round);
        q.still = true;
        return q;
      }();
      const wire::Plan plan = s.ask(r);
      const uint64_t cast = s.cast(r, plan);
      extra += cast;
      if (cast == 0) break;
    }
    EXPECT_GT(extra, 0u);
  }
}

// If finer rays meet nothing, no point shows it; their patches do.
TEST(Plan, PatchesOfFinerRaysTellWhichOfThemMetNothing) {
  PlanConfig config = plan_config();
  config.validation = 0, config.view_cell_m = 0;
  Session s(config);
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 160, 120);
  s.view(camera);
  s.view(camera);
  uint64_t frames = 0, missed = 0;
  for (uint64_t round = 0;; ++round, ++frames) {
    wire::PlanRequest r = s.request(camera, true, round);
    r.still = true;
    const wire::Plan plan = s.ask(r);
    if (plan.tiles.empty()) break;
    for (test::PlannedTile& planned : test::planned_tiles(r, plan)) {
      SampledTile& tile = planned.tile;
      s.planner.take(tile, planned.whole, s.now_s);
      tile.missed = s.planner.missed(tile);
      ASSERT_EQ(tile.missed.width(), tile.rect.width);
      const auto hits = std::count_if(tile.image.depth.begin(), tile.image.depth.end(), [](uint32_t d) { return d; });
      EXPECT_EQ(tile.missed.count() + uint64_t(hits), planned.rays);
      const geometry::Rect rect = tile.rect;
      const image::PixelMask mask = tile.missed;
      const auto event = s.core.submit(std::move(tile), s.now_s);
      ASSERT_TRUE(event.ok() && *event);
      EXPECT_EQ((*event)->missed_rect, rect);
      const auto told = codec::decode_mask((*event)->missed, rect.width, rect.height);
      ASSERT_TRUE(told.ok());
      EXPECT_EQ(*told, mask);
      missed += mask.count();
    }
  }
  EXPECT_GT(frames, 1u);
  EXPECT_GT(missed, 100u) << "beside the ball";

  // Rays of a view, and rays without a plan, report no misses.
  const wire::PlanRequest r = s.request(test::scene_camera({0.6, 0.3, 0.25}, 160, 120));
  for (test::PlannedTile& planned : test::planned_tiles(r, s.ask(r)))
    EXPECT_EQ(s.planner.missed(planned.tile).width(), 0);
  SampledTile wrong;
  wrong.frame = {12345}, wrong.camera = camera, wrong.rect = {0, 0, 4, 4}, wrong.image = image::DepthImage(4, 4);
  EXPECT_EQ(s.planner.missed(wrong).width(), 0);
  wrong.epoch = test::kEpoch, wrong.tiles_in_frame = 1, wrong.missed = image::PixelMask(3, 4);
  EXPECT_FALSE(s.core.submit(std::move(wrong), 1).ok());
}

// Returns a view after its rays are in, sampled whole or by plans.
ViewMap shown(const PackerCore& core, const geometry::Camera& camera) {
  splat::ViewKeys keys(1);
  ViewMap map;
  render_view_map(core.model(), camera, {}, keys, map);
  return map;
}

TEST(Plan, ShowsWhatFullSamplingShows) {
  PlanConfig config = plan_config();
  Session steered(config), whole(config);
  for (int i = 0; i < 8; ++i) {
    const geometry::Camera camera =
        test::scene_camera({0.7 * std::cos(0.05 * i), 0.3, 0.7 * std::sin(0.05 * i)}, 240, 180);
    steered.view(camera);
    wire::Plan all;
    all.full = true;
    const wire::PlanRequest r = whole.request(camera);
    whole.cast(r, all);
    const ViewMap a = shown(steered.core, camera), b = shown(whole.core, camera);
    size_t holes = 0, off = 0;
    for (size_t p = 0; p < a.depth_m.size(); ++p) {
      holes += std::isinf(a.depth_m[p]) != std::isinf(b.depth_m[p]);
      off += std::abs(a.depth_m[p] - b.depth_m[p]) > 0.02f * b.depth_m[p];
    }
    EXPECT_LT(double(holes), 0.002 * double(a.depth_m.size())) << i;
    EXPECT_LT(double(off), 0.004 * double(a.depth_m.size())) << i;
  }
}

TEST(Plan, AViewThatNeedsNothingIsCompleteAtOnce) {
  PlanConfig config = plan_config();
  config.validation = 0;
  Session s(config);
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 160, 120);
  s.view(camera);
  EXPECT_EQ(s.view(camera), 0u);
  EXPECT_TRUE(s.last.tiles.empty());
  EXPECT_FALSE(s.last.full);
  const auto event =
      s.core.complete_empty({.frame = {1000}, .epoch = test::kEpoch, .viewer = {77}, .camera = camera}, 1);
  ASSERT_TRUE(event.ok() && *event);
  EXPECT_TRUE((*event)->frame_complete);
  EXPECT_EQ((*event)->kept, 0u);
}

TEST(Plan, WhatCoarseDataStoodInForIsCastAgainAndThenGoes) {
  PlanConfig config = plan_config();
  config.validation = 0;
  Session s(config), plain(config);
  const geometry::Camera first = test::scene_camera({0.6, 0.3, 0.2}, 160, 120),
                         moved = test::scene_camera({0.6, 0.3, 0.202}, 160, 120);
  s.coarse = true;
  EXPECT_EQ(s.view(first), 160u * 120u);
  EXPECT_GT(s.core.model().points(), 0u);
  EXPECT_TRUE(s.core.forget_superseded().empty()) << "nothing else shows the view";
  s.coarse = false;
  EXPECT_EQ(s.view(first), 160u * 120u) << "as if nothing had come";
  EXPECT_FALSE(s.core.forget_superseded().empty());
  plain.view(first);
  EXPECT_EQ(s.core.model().points(), plain.core.model().points());
  EXPECT_EQ(s.view(first), 0u);

  s.coarse = true;
  const uint64_t rays = s.view(moved);
  EXPECT_FALSE(s.last.full);
  EXPECT_GT(rays, 100u);
  s.coarse = false;
  EXPECT_EQ(s.view(moved), rays);
  EXPECT_FALSE(s.core.forget_superseded().empty());
  plain.view(moved);
  EXPECT_EQ(s.core.model().points(), plain.core.model().points());
}

TEST(Plan, StrangeRequestsAreAnswered) {
  Session s;
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 160, 120);
  s.view(camera);
  auto ask = [&](auto change) {
    wire::PlanRequest r = s.request(camera);
    change(r);
    return s.ask(r);
  };
  EXPECT_TRUE(ask([](auto& r) { r.camera.width = 0; }).tiles.empty());
  EXPECT_TRUE(ask([](auto& r) { r.camera.left = NAN; }).tiles.empty());
  EXPECT_TRUE(ask([](auto& r) { r.camera.pose.position_room.x = INFINITY; }).tiles.empty());
  for (const uint64_t number : {uint64_t{0}, uint64_t{1}, uint64_t{31}, ~uint64_t{0}}) {
    for (const bool extra : {false, true}) {
      const wire::Plan plan = ask([&](auto& r) {
        r.extra = extra, r.still = number == 1;
        r.tile_size = number, r.tile_rays = number, r.most_rays = number, r.round = number;
      });
      for (size_t i = 0; i < plan.tiles.size(); i += wire::kPlanNumbers) EXPECT_GE(plan.tiles[i + 4], 1u);
    }
  }
  // Away from everything; inside the scene; very large and very small.
  ask([](auto& r) { r.camera.pose.position_room = {1e6, 0, 0}; });
  ask([](auto& r) { r.camera.pose.position_room = {0, 0, 0}; });
  ask([](auto& r) { r.camera.width = r.camera.height = 1; });
  ask([](auto& r) { r.camera.width = geometry::kMaxImageSide, r.camera.height = 1, r.extra = true; });
}

// When nothing is left to find, the search beyond a view is short: other views are planned in between.
TEST(Plan, WhatIsBeyondAViewIsLookedForInPieces) {
  PlanConfig config = plan_config();
  config.validation = 0;
  Session s(config);
  s.view(test::scene_camera({0.6, 0.3, 0.2}, 160, 120));
  // A look past the scene, where no surface can be.
  const geometry::Camera away = geometry::make_camera(geometry::look_at({1, 0.3, 0.2}, {3, 0.3, 0.2}), 60, 1280, 960);
  EXPECT_EQ(s.view(away), 0u);
  EXPECT_EQ(s.view(away), 0u);
  wire::PlanRequest r = s.request(away, true, 0);
  r.still = true;
  const auto piece = [&] { return s.planner.plan_piece(s.core.model(), s.core.sequence(), r, s.now_s += 0.1); };
  int pieces = 0;
  std::optional<wire::Plan> plan;
  for (; pieces < 100 && !(plan = piece()); ++pieces) EXPECT_EQ(s.view(away), 0u);
  EXPECT_EQ(pieces, 8) << "one for each view from beside, before finer rays are looked for";
  ASSERT_TRUE(plan);
  EXPECT_TRUE(plan->tiles.empty());
  EXPECT_TRUE(piece()) << "nothing is looked at twice";
  r.viewer = {78};
  EXPECT_TRUE(s.ask(r).tiles.empty()) << "at once";
}

// Each tile costs the packer and viewers time, and a head that rests waits for each question.
TEST(Plan, FinerRaysOfAStillViewComeInFewPlansOfFewTiles) {
  PlanConfig config = plan_config();
  config.validation = 0;
  config.view_cell_m = 0;
  Session s(config);
  const geometry::Camera camera = test::scene_camera({0.5, 0.2, 0.2}, 960, 720);
  while (s.view(camera) > 0) {
  }
  for (const int times : {2, 4}) {
    wire::PlanRequest r = s.request(camera, true);
    r.still = true;
    r.tile_size = 1024;
    const wire::Plan plan = s.ask(r);
    EXPECT_EQ(plan.camera.width, times * camera.width) << "all of the edges in one plan, however many pieces it took";
    const uint64_t squares = uint64_t(times) * uint64_t(times);
    EXPECT_GT(plan.tiles.size(), 0u);
    EXPECT_LE(plan.tiles.size() / wire::kPlanNumbers, 2 * squares);
    s.cast(r, plan);
  }
}

// Splats cannot show everything: a ray that always meets another surface must not make a still view cast the pixels
// around it again and again.
TEST(Plan, AStillViewGetsOverARayThatAlwaysContradicts) {
  PlanConfig config = plan_config();
  config.validation = 1;
  Session s(config);
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 320, 240);
  s.view(camera);
  const ViewMap map = shown(s.core, camera);
  int at_x = 0, at_y = 0;
  for (int y = 8; y < 232 && at_x == 0; ++y)
    for (int x = 8; x < 312 && at_x == 0; ++x) {
      bool inside = true;
      for (int dy = -8; dy <= 8; ++dy)
        for (int dx = -8; dx <= 8; ++dx) inside &= map.covered.at(x + dx, y + dy) && !map.edge.at(x + dx, y + dy);
      if (inside) at_x = x, at_y = y;
    }
  ASSERT_GT(at_x, 0);
  int stale = 0;
  for (int i = 0; i < 40; ++i) {
    const wire::PlanRequest r = s.request(camera);
    const wire::Plan plan = s.ask(r);
    ASSERT_FALSE(plan.full);
    stale += plan.figures.at("rays.stale") > 0;
    for (test::PlannedTile& planned : test::planned_tiles(r, plan)) {
      const geometry::Rect& rect = planned.tile.rect;
      if (at_x >= rect.x && at_x < rect.x + rect.width && at_y >= rect.y && at_y < rect.y + rect.height) {
        const size_t pixel = static_cast<size_t>(at_y - rect.y) * rect.width + static_cast<size_t>(at_x - rect.x);
        planned.tile.image.depth[pixel] = 0, planned.tile.image.colour[pixel] = 0, planned.tile.image.normal[pixel] = 0;
      }
      s.submit(std::move(planned.tile), planned.whole);
    }
  }
  EXPECT_EQ(stale, 1);
  EXPECT_EQ(s.forgets, 0u);
}

TEST(Plan, LargeViewsAreNotPlanned) {
  Session s;
  s.view(test::scene_camera({0.6, 0.3, 0.2}, 160, 120));
  for (const auto& [width, height] : {std::pair{4096, 2049}, {8192, 8192}, {16384, 16384}}) {
    const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, width, height);
    EXPECT_TRUE(s.ask(s.request(camera)).full);
    const wire::Plan extra = s.ask(s.request(camera, true));
    EXPECT_TRUE(extra.tiles.empty() && !extra.full);
  }
}

TEST(Plan, TilesOfUnknownFramesAndWrongRectanglesChangeNothing) {
  Session s;
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 160, 120);
  s.view(camera);
  const wire::PlanRequest r = s.request(camera);
  const wire::Plan plan = s.ask(r);
  SampledTile tile;
  tile.frame = {r.frame.value}, tile.camera = camera, tile.rect = {1, 1, 5, 5}, tile.image = image::DepthImage(5, 5);
  s.planner.take(tile, false, 1);  // the plan's frame, but no tile of the plan
  tile.camera.width = 80;
  s.planner.take(tile, false, 1);
  tile.frame = {12345};
  s.planner.take(tile, false, 1);
  s.planner.take(tile, true, 1);
  while (s.planner.settle()) {
  }
  EXPECT_GT(s.cast(r, plan), 0u) << "its tiles are taken still";
}

// A sampler could not read their masks.
TEST(Plan, TilesThatCameWholeAreThoseOfThePlan) {
  PlanConfig config = plan_config();
  config.validation = 0;
  Session s(config);
  s.view(test::scene_camera({0.6, 0.3, 0.2}, 320, 240));
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.22}, 320, 240);
  const wire::PlanRequest r = s.request(camera);
  const wire::Plan plan = s.ask(r);
  ASSERT_FALSE(plan.tiles.empty() || plan.full);
  const size_t count = plan.tiles.size() / wire::kPlanNumbers;
  for (size_t i = 0; i < count; ++i) {
    const uint32_t* n = &plan.tiles[i * wire::kPlanNumbers];
    SampledTile tile;
    tile.frame = r.frame, tile.epoch = r.epoch, tile.viewer = r.viewer, tile.request = r.request;
    tile.tile = uint32_t(i), tile.tiles_in_frame = uint32_t(count);
    tile.camera = camera, tile.rect = {int(n[0]), int(n[1]), int(n[2]), int(n[3])};
    tile.image = test::sample_scene(camera, tile.rect);
    s.submit(std::move(tile), true);
  }
  EXPECT_LT(s.view(camera), 50u) << "all that was planned has come";
  EXPECT_EQ(s.forgets, 0u);
}

// The master gave them up for a newer view, but a sampler had begun them.
TEST(Plan, TilesOfAnExtraFrameThatComeLateAreTakenAllTheSame) {
  Session s;
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 320, 240);
  s.view(camera);
  s.view(camera);
  wire::PlanRequest given_up = s.request(camera);
  given_up.extra = true;
  const wire::Plan plan = s.ask(given_up);
  ASSERT_FALSE(plan.tiles.empty());
  s.now_s += 0.6;
  wire::PlanRequest next = s.request(camera);
  next.extra = true, next.round = 1;
  s.ask(next);
  EXPECT_GT(s.cast(given_up, plan), 0u);
  s.view(camera);
  EXPECT_FALSE(s.last.full);
}

// Near a surface a step aside uncovers much: the rays to cast would have no end.
TEST(Plan, FromBesideAHeadMovesNoFartherThanTheNearestSurface) {
  Session s;
  s.view(test::scene_camera({0.7, 0.1, 0}, 160, 120));
  const geometry::Camera camera = test::scene_camera({0.34, 0.06, 0}, 160, 120);
  s.view(camera);
  s.view(camera);
  const ViewMap map = shown(s.core, camera);
  const double nearest_m = *std::min_element(map.depth_m.begin(), map.depth_m.end());
  ASSERT_LT(nearest_m, 0.15);
  std::set<std::tuple<double, double, double>> places;
  for (uint64_t round = 0; round < 40; ++round) {
    wire::PlanRequest r = s.request(camera, true, round);
    r.still = true;
    const wire::Plan plan = s.ask(r);
    if (plan.tiles.empty()) break;
    const glm::dvec3 p = plan.camera.pose.position_room;
    EXPECT_LE(glm::distance(p, camera.pose.position_room), 1.02 * nearest_m);
    places.insert({p.x, p.y, p.z});
    s.cast(r, plan);
  }
  EXPECT_GT(places.size(), 2u) << "its own and others";
}

TEST(Plan, FinerRaysThatComeLateTellNothingOfWhatTheyMissed) {
  PlanConfig config = plan_config();
  config.view_cell_m = 0;
  Session s(config);
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 320, 240);
  s.view(camera);
  s.view(camera);
  wire::PlanRequest given_up = s.request(camera, true);
  given_up.still = true;
  const wire::Plan plan = s.ask(given_up);
  const auto tiles = test::planned_tiles(given_up, plan);
  ASSERT_FALSE(tiles.empty());
  EXPECT_EQ(s.planner.missed(tiles[0].tile).width(), tiles[0].tile.rect.width);
  s.now_s += 0.6;
  wire::PlanRequest next = s.request(camera, true, 1);
  next.still = true;
  s.ask(next);
  for (const test::PlannedTile& late : tiles) {
    s.planner.take(late.tile, late.whole, s.now_s);
    EXPECT_EQ(s.planner.missed(late.tile).width(), 0) << "its mask is another frame's now";
  }
}

TEST(Plan, ANewEpochIsSampledWholeAndFollowedByPlans) {
  Session s;
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 160, 120);
  s.view(camera);
  s.view(camera);
  EXPECT_FALSE(s.last.full);
  ASSERT_TRUE(s.core.begin_epoch({test::kEpoch.value + 1}));
  const wire::Plan plan = s.ask(s.request(camera));
  EXPECT_TRUE(plan.full);
}

TEST(Plan, AnotherPlannerGoesOnWithTheModelThatIsThere) {
  Session s;
  const geometry::Camera camera = test::scene_camera({0.6, 0.3, 0.2}, 160, 120);
  s.view(camera);
  Planner another(plan_config());
  another.learn(s.core.model());
  const wire::Plan plan = another.plan(s.core.model(), s.core.sequence(), s.request(camera), 1);
  EXPECT_FALSE(plan.frame == FrameId{});
  const wire::Plan extra = another.plan(s.core.model(), s.core.sequence(), s.request(camera, true), 1);
  EXPECT_FALSE(extra.full);
}

TEST(Plan, ChecksKnownEmptyPixelsInTurn) {
  PlanConfig config = plan_config();
  config.validation = 4;  // 32 sets of pixels, four in each plan of a still view, one of them where nothing is
  Session s(config);
  const geometry::Camera camera = test::scene_camera({0.7, 0.3, 0.2}, 320, 240);
  for (int i = 0; i < 4; ++i) s.view(camera);
  const image::DepthImage scene = test::sample_scene(camera, {0, 0, 320, 240});
  std::vector<int> cast(scene.pixels());
  for (int i = 0; i < 64; ++i) {
    s.now_s += 0.1;
    const wire::PlanRequest r = s.request(camera);
    const wire::Plan plan = s.ask(r);
    for (size_t tile = 0, word = 0; tile < plan.tiles.size() / wire::kPlanNumbers; ++tile) {
      const uint32_t* n = &plan.tiles[tile * wire::kPlanNumbers];
      const auto mask = codec::decode_mask(std::span(plan.masks).subspan(word, n[5]), int(n[2]), int(n[3]));
      ASSERT_TRUE(mask.ok());
      for (int y = 0; y < int(n[3]); ++y)
        for (int x = 0; x < int(n[2]); ++x) cast[(n[1] + size_t(y)) * 320 + n[0] + size_t(x)] += mask->at(x, y);
      word += n[5];
    }
    s.cast(r, plan);
  }
  int empty = 0;
  for (int y = 8; y < 232; ++y)
    for (int x = 8; x < 312; ++x) {
      bool nothing = true;
      for (int n = 0; n < 289; ++n) nothing &= scene.depth[size_t(y + n / 17 - 8) * 320 + size_t(x + n % 17 - 8)] == 0;
      if (!nothing) continue;
      ++empty;
      EXPECT_EQ(cast[size_t(y) * 320 + size_t(x)], 2) << x << ", " << y;
    }
  EXPECT_GT(empty, 5000);
}

TEST(Plan, AWalkNeedsFewRays) {
  Session s;
  uint64_t rays = 0, full = 0;
  for (int i = 0; i < 30; ++i) {
    const double turn = 0.01 * i;
    const geometry::Camera camera = test::scene_camera({0.7 * std::cos(turn), 0.3, 0.7 * std::sin(turn)}, 320, 240);
    const uint64_t cast = s.view(camera);
    if (i > 0) rays += cast, full += 320 * 240;
  }
  EXPECT_LT(double(rays), 0.08 * double(full));
  EXPECT_EQ(s.forgets, 0u);
}

}  // namespace
}  // namespace telesplat::packer
