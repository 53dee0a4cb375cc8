// Plans: views wait for them, become masked tiles, and an idle time is used for extra rays. Without sockets and clocks.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/codec/mask_stream.h"
#include "common/volume/session.h"
#include "services/master/master_core.h"
#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

using Outcome = metrics::PlanRow::Outcome;

wire::ViewRequest request(uint64_t viewer, uint64_t id, double x = 0) {
  wire::ViewRequest r;
  r.viewer = {viewer};
  r.request = {id};
  r.camera.pose.position_room.x = x;
  r.camera.width = 256;
  r.camera.height = 128;
  return r;
}

struct Tile {
  geometry::Rect rect;
  uint32_t rays;
  std::vector<uint32_t> mask = {};
};
wire::Plan plan_of(const wire::PlanRequest& asked, const std::vector<Tile>& tiles) {
  wire::Plan out{.frame = asked.frame, .epoch = asked.epoch, .camera = asked.camera};
  for (const Tile& t : tiles) {
    for (const int n : {t.rect.x, t.rect.y, t.rect.width, t.rect.height}) out.tiles.push_back(uint32_t(n));
    out.tiles.push_back(t.rays);
    out.tiles.push_back(uint32_t(t.mask.size()));
    out.masks.insert(out.masks.end(), t.mask.begin(), t.mask.end());
  }
  return out;
}
// A tile whose mask has only the first `rays` pixels.
Tile masked(const geometry::Rect& rect, uint32_t rays) {
  image::PixelMask mask(rect.width, rect.height);
  for (int i = 0; i < int(rays); ++i) mask.set(i % rect.width, i / rect.width);
  return {rect, rays, codec::encode_mask(mask)};
}
const std::vector<Tile> kTwoTiles{masked({64, 0, 64, 64}, 30), {{0, 64, 32, 32}, 1024}};

class Steered : public testing::Test {
 protected:
  void SetUp() override { schedule.set_cut({.steered = true}); }
  // Returns the open question to the packer; there must be one.
  wire::PlanRequest asked() {
    const auto questions = schedule.take_questions();
    EXPECT_EQ(questions.size(), 1u);
    return questions.empty() ? wire::PlanRequest{} : questions[0];
  }
  wire::PlanRequest ask(uint64_t viewer, uint64_t id, double x = 0) {
    schedule.request_view(request(viewer, id, x));
    EXPECT_TRUE(schedule.begin_view({1}, false, now));
    return asked();
  }
  wire::PlanRequest ask_extra() {
    schedule.begin_extra({1}, now);
    return asked();
  }
  bool asks_extra() {
    schedule.begin_extra({1}, now);
    return !schedule.take_questions().empty();
  }
  void answer(const wire::PlanRequest& to, const std::vector<Tile>& tiles) {
    const Status s = schedule.take_plan(plan_of(to, tiles), now);
    EXPECT_TRUE(s) << s.error().text;
  }
  std::vector<wire::Lease> leases() {
    std::vector<wire::Lease> out;
    while (const auto l = schedule.lease("a", now)) out.push_back(*l);
    return out;
  }
  bool done(const wire::Lease& l, double took_s = 0.001) {
    wire::TileDone m{.frame = l.frame, .tile = l.tile, .lease = l.lease, .extra = l.extra, .rays = l.rays};
    m.moments = l.moments;
    m.moments.sample_begin_s = l.moments.leased_s;
    m.moments.sample_end_s = m.moments.encode_end_s = l.moments.leased_s + took_s;
    return schedule.tile_done(m, "a", now);
  }
  // A view from beginning to end that needs no ray.
  wire::PlanRequest look(uint64_t viewer, uint64_t id, double x = 0) {
    const auto question = ask(viewer, id, x);
    answer(question, {});
    return question;
  }

  double now = 10;
  FrameSchedule schedule{{.tile_size = 64}};
};

TEST_F(Steered, AViewWaitsForItsPlanAndBecomesItsTiles) {
  const auto question = ask(5, 7, 0.25);
  EXPECT_EQ(question.viewer.value, 5u);
  EXPECT_EQ(question.request.value, 7u);
  EXPECT_EQ(question.camera, request(5, 7, 0.25).camera);
  EXPECT_EQ(question.tile_size, 512u) << "few rays lie in a tile";
  EXPECT_GT(question.tile_rays, 0u);
  EXPECT_GT(question.most_rays, 0u) << "others are left to later views";
  EXPECT_FALSE(question.extra || question.still);
  EXPECT_TRUE(leases().empty());
  EXPECT_EQ(schedule.views_in_flight(), 1u);
  now += 0.01;
  answer(question, kTwoTiles);
  const auto l = leases();
  ASSERT_EQ(l.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(l[i].frame, question.frame);
    EXPECT_EQ(l[i].tile, i);
    EXPECT_EQ(l[i].block, i);
    EXPECT_EQ(l[i].blocks_in_frame, 2u);
    EXPECT_EQ(l[i].rect, kTwoTiles[i].rect);
    EXPECT_EQ(l[i].block_rect, l[i].rect);
    EXPECT_EQ(l[i].rays, kTwoTiles[i].rays);
    EXPECT_EQ(l[i].mask, kTwoTiles[i].mask);
    EXPECT_EQ(l[i].step, 1u);
    EXPECT_FALSE(l[i].extra);
    const std::string body = wire::encode(l[i]);
    EXPECT_TRUE(wire::decode<wire::Lease>(std::as_bytes(std::span(body))));
  }
  EXPECT_TRUE(done(l[1]));
  EXPECT_EQ(schedule.frames_completed(), 0u);
  EXPECT_TRUE(done(l[0]));
  EXPECT_EQ(schedule.frames_completed(), 1u);
  const auto rows = schedule.take_plan_rows();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].outcome, Outcome::kTiles);
  EXPECT_EQ(rows[0].rays_cast(), 1054u);
  EXPECT_EQ(rows[0].rays_full(), 256u * 128u);
  EXPECT_EQ(rows[0].mask_bytes, 4 * kTwoTiles[0].mask.size());
  EXPECT_NEAR(rows[0].planned_s - rows[0].asked_s, 0.01, 1e-9);
}

TEST_F(Steered, TilesAreSmallerWhereManySamplersShareThem) {
  for (const char* sampler : {"a", "b", "c"}) (void)schedule.lease(sampler, now);
  EXPECT_EQ(ask(5, 7).tile_size, 128u);
}

TEST_F(Steered, AHeadThatRestsDoesNotWaitForRaysThatRefine) {
  const auto moving = ask(5, 1);
  EXPECT_TRUE(schedule.take_plan(plan_of(moving, {}), now));
  const auto still = ask(5, 2);
  ASSERT_TRUE(still.still);
  EXPECT_EQ(still.most_rays, kStillViews * moving.most_rays);
  // Its time does not count.
  wire::Plan plan = plan_of(still, kTwoTiles);
  plan.figures["rays.sparse"] = double(still.most_rays);
  EXPECT_TRUE(schedule.take_plan(plan, now));
  now += 1;
  for (const auto& lease : leases()) EXPECT_TRUE(done(lease));
  EXPECT_EQ(ask(5, 3).most_rays, still.most_rays);
}

TEST_F(Steered, RaysThatRefineFollowTheTimeThatViewsTake) {
  auto view_that_takes = [&, id = uint64_t{1}](double s, bool edges = false) mutable {
    const auto question = ask(5, id, double(id));  // the head moves
    ++id;
    wire::Plan plan = plan_of(question, kTwoTiles);
    plan.figures["rays.sparse"] = edges ? 0 : double(question.most_rays);
    plan.figures["rays.edge"] = edges ? RefiningRays::kEdges * double(question.most_rays) : 0;
    plan.figures["rays.put_off"] = 1000;
    EXPECT_TRUE(schedule.take_plan(plan, now));
    now += s;
    for (const auto& lease : leases()) EXPECT_TRUE(done(lease));
    return question.most_rays;
  };
  const uint64_t first = view_that_takes(0.2), second = view_that_takes(0.2);
  EXPECT_LT(second, 0.8 * double(first));
  for (int i = 0; i < 20; ++i) (void)view_that_takes(0.2);
  const uint64_t least = view_that_takes(0.01);
  EXPECT_GE(least, uint64_t(RefiningRays::kLeast));
  for (int i = 0; i < 20; ++i) (void)view_that_takes(0.01);
  const uint64_t many = view_that_takes(0.01);
  EXPECT_GT(many, 2 * first);
  for (int i = 0; i < 20; ++i) (void)view_that_takes(0.2, true);
  EXPECT_LT(view_that_takes(0.2), many / 2) << "rays at edges take time, too";
}

// 256 x 128 pixels in eight tiles.
TEST_F(Steered, RaysArePutOffOnlyWhereAWholeViewWouldTakeLong) {
  auto next_after = [&, id = uint64_t{1}](double tile_s) mutable {
    wire::Plan full = plan_of(ask(5, id, double(id)), {});
    full.full = true;
    EXPECT_TRUE(schedule.take_plan(full, now));
    for (const auto& lease : leases()) EXPECT_TRUE(done(lease, tile_s));
    id += 2;
    return look(5, id - 1, double(id)).most_rays;
  };
  EXPECT_EQ(next_after(0.001), 0u) << "8 ms: as many as there are";
  for (int i = 0; i < 5; ++i) (void)next_after(0.04);
  EXPECT_GT(next_after(0.04), 0u) << "0.32 s";
}

TEST_F(Steered, AViewOfWhichMuchIsUnseenIsSampledCoarserWhereItWouldTakeLong) {
  auto cameras_width = [&, id = uint64_t{1}](double tile_s, double unseen, bool still = false) mutable {
    if (!still) ++id;
    wire::Plan full = plan_of(ask(5, 100 + id, double(id)), {});
    full.full = true;
    full.figures["rays.nothing"] = unseen / 2, full.figures["rays.unproven"] = unseen / 2;
    EXPECT_TRUE(schedule.take_plan(full, now));
    int width = 0;
    for (const auto& lease : leases()) {
      width = lease.camera.width;
      EXPECT_EQ(lease.step, 1u) << "the view is complete with it";
      EXPECT_EQ(lease.camera.left, request(5, 1).camera.left);
      EXPECT_EQ(lease.frame, full.frame);
      EXPECT_TRUE(done(lease, tile_s));
    }
    return width;
  };
  EXPECT_EQ(cameras_width(0.001, 30000), 256) << "nothing is known of the time";
  EXPECT_EQ(cameras_width(0.04, 30000), 256) << "8 ms";
  for (int i = 0; i < 20; ++i) (void)cameras_width(0.04, 0);
  EXPECT_EQ(cameras_width(0.04, 30000), 128) << "0.32 s: a fourth of the pixels";
  EXPECT_EQ(cameras_width(0.04, 30000, true), 256) << "a head that rests";
  EXPECT_EQ(cameras_width(0.04, 8000), 256) << "most is shown: coarser samples would bring nothing";
  for (int i = 0; i < 20; ++i) (void)cameras_width(2, 0);
  EXPECT_EQ(cameras_width(2, 30000), 256 / kCoarseStep) << "no coarser than this";
}

TEST_F(Steered, AViewThatNeedsNothingIsCompleteAtOnce) {
  look(5, 1);
  EXPECT_TRUE(leases().empty());
  EXPECT_EQ(schedule.frames_completed(), 1u);
  EXPECT_EQ(schedule.views_in_flight(), 0u);
  EXPECT_EQ(schedule.take_plan_rows().at(0).outcome, Outcome::kEmpty);
}

TEST_F(Steered, AFullPlanIsCutAsIfNobodyHadPlanned) {
  wire::Plan full = plan_of(ask(5, 1), {});
  full.full = true;
  ASSERT_TRUE(schedule.take_plan(full, now));
  const auto l = leases();
  ASSERT_EQ(l.size(), 8u);
  for (const auto& lease : l) {
    EXPECT_EQ(lease.frame, full.frame);
    EXPECT_TRUE(lease.mask.empty());
    EXPECT_EQ(lease.rays, 64u * 64u);
  }
  EXPECT_EQ(schedule.take_plan_rows().at(0).outcome, Outcome::kFull);

  FrameSchedule julia({.tile_size = 64});
  julia.set_cut({.rows = true, .coarse = true, .steered = true});
  julia.request_view(request(5, 1));
  ASSERT_TRUE(julia.begin_view({1}, false, now));
  const auto question = julia.take_questions().at(0);
  full = plan_of(question, {});
  full.full = true;
  ASSERT_TRUE(julia.take_plan(full, now));
  auto lease = julia.lease("a", now);
  ASSERT_TRUE(lease);
  EXPECT_EQ(lease->step, uint64_t(kCoarseStep)) << "coarse first";
  EXPECT_LT(lease->frame, question.frame);
  for (int i = 0; i < 1000 && lease && lease->step != 1; ++i) lease = julia.lease(i % 2 ? "a" : "b", now);
  ASSERT_TRUE(lease);
  EXPECT_EQ(lease->frame, question.frame) << "the one that was asked for";
  EXPECT_EQ(lease->rays, uint64_t(lease->rect.width) * uint64_t(lease->rect.height));
}

TEST_F(Steered, AViewWhosePlanIsLateIsSampledWhole) {
  const auto question = ask(5, 1);
  now += kLeastPatience_s - 0.01;
  schedule.give_up_plans(now);
  EXPECT_TRUE(leases().empty());
  now += 0.02;
  schedule.give_up_plans(now);
  EXPECT_EQ(leases().size(), 8u);
  EXPECT_EQ(schedule.take_plan_rows().at(0).outcome, Outcome::kLate);
  answer(question, kTwoTiles);  // too late: the view no longer waits for it
  EXPECT_TRUE(leases().empty());
  EXPECT_EQ(schedule.views_in_flight(), 1u);
  EXPECT_TRUE(schedule.take_plan_rows().empty());
}

TEST_F(Steered, APackerThatDoesNotAnswerIsNotAskedForAWhile) {
  const auto wait_in_vain = [&](uint64_t id) {
    ask(5, id);
    now += kLeastPatience_s + 0.01;
    schedule.give_up_plans(now);
    for (const auto& l : leases()) done(l);
  };
  wait_in_vain(1);
  EXPECT_TRUE(schedule.steered(now)) << "once may be chance";
  wait_in_vain(2);
  EXPECT_FALSE(schedule.steered(now));
  // Views go on without plans, and may overlap.
  for (uint64_t id = 3; id <= 4; ++id) {
    schedule.request_view(request(5, id));
    EXPECT_TRUE(schedule.begin_view({1}, false, now));
    EXPECT_TRUE(schedule.take_questions().empty());
  }
  for (const auto& l : leases()) done(l);
  EXPECT_EQ(schedule.frames_completed(), 4u);
  EXPECT_FALSE(asks_extra());
  now += kFirstRest_s;
  EXPECT_TRUE(schedule.steered(now));
  wait_in_vain(5);
  EXPECT_FALSE(schedule.steered(now + 1.5 * kFirstRest_s)) << "longer this time";
  schedule.trust_packer();  // another packer
  look(5, 6);
  EXPECT_TRUE(schedule.steered(now));
}

TEST_F(Steered, AViewerHasOneViewPlannedOrInFlight) {
  const auto first = ask(5, 1);
  schedule.request_view(request(5, 2));
  EXPECT_FALSE(schedule.begin_view({1}, false, now));
  schedule.request_view(request(6, 1));
  EXPECT_TRUE(schedule.begin_view({1}, false, now)) << "of another viewer";
  const auto other = asked();
  EXPECT_EQ(other.viewer.value, 6u);
  answer(first, kTwoTiles);
  EXPECT_FALSE(schedule.begin_view({1}, false, now));
  for (const auto& l : leases()) done(l);
  EXPECT_TRUE(schedule.begin_view({1}, false, now));
  EXPECT_EQ(asked().request.value, 2u);
}

TEST_F(Steered, AStillHeadIsToldToThePacker) {
  EXPECT_FALSE(look(5, 1, 0.1).still);
  EXPECT_TRUE(look(5, 2, 0.1).still);
  EXPECT_FALSE(look(6, 2, 0.1).still) << "another viewer";
  EXPECT_FALSE(look(5, 3, 0.2).still);
  EXPECT_TRUE(look(5, 4, 0.2).still);
}

TEST_F(Steered, WhenNothingIsLeftToDoMoreIsCast) {
  EXPECT_FALSE(asks_extra()) << "there is no view";
  const auto view = ask(5, 1);
  EXPECT_FALSE(asks_extra()) << "it is not complete";
  answer(view, kTwoTiles);
  EXPECT_FALSE(asks_extra());
  for (const auto& l : leases()) done(l);
  for (uint64_t round = 0; round < 3; ++round) {
    auto question = ask_extra();
    EXPECT_TRUE(question.extra);
    EXPECT_EQ(question.round, round);
    EXPECT_EQ(question.viewer.value, 5u);
    EXPECT_EQ(question.request.value, 1u);
    EXPECT_GT(question.most_rays, 0u);
    EXPECT_FALSE(asks_extra()) << "one at a time";
    wire::Plan plan = plan_of(question, {masked({300, 200, 64, 32}, 99)});
    plan.camera.width = 512, plan.camera.height = 256;
    ASSERT_TRUE(schedule.take_plan(plan, now));
    const auto l = leases();
    ASSERT_EQ(l.size(), 1u);
    EXPECT_TRUE(l[0].extra);
    EXPECT_EQ(l[0].camera, plan.camera);
    EXPECT_EQ(l[0].request.value, 1u);
    EXPECT_FALSE(asks_extra()) << "the packer has not seen what came of it";
    EXPECT_TRUE(done(l[0]));
  }
  EXPECT_EQ(schedule.frames_completed(), 1u) << "of views";
  answer(ask_extra(), {});
  EXPECT_FALSE(asks_extra()) << "nothing is left";
  look(5, 2);
  EXPECT_TRUE(asks_extra()) << "another view";
}

TEST_F(Steered, ViewsComeBeforeExtraTiles) {
  look(5, 1);
  answer(ask_extra(), kTwoTiles);
  const auto extra = schedule.lease("a", now);
  ASSERT_TRUE(extra && extra->extra);
  const auto view = ask(5, 2);
  answer(view, kTwoTiles);
  const auto l = leases();
  ASSERT_EQ(l.size(), 3u);
  EXPECT_FALSE(l[0].extra || l[1].extra);
  EXPECT_TRUE(l[2].extra) << "when nobody needs anything else";
  for (const auto& lease : {*extra, l[2]}) EXPECT_TRUE(done(lease));
  EXPECT_EQ(schedule.frames_in_flight(), 1u);
  for (const auto& lease : {l[0], l[1]}) EXPECT_TRUE(done(lease));
  EXPECT_EQ(schedule.frames_completed(), 2u);
}

TEST_F(Steered, OldExtraTilesAreDroppedWhenAnotherViewBegins) {
  look(5, 1);
  answer(ask_extra(), kTwoTiles);
  const auto extra = schedule.lease("a", now);
  ASSERT_TRUE(extra);
  now += kExtraPatience_s + 0.01;
  look(5, 2, 0.1);
  EXPECT_TRUE(leases().empty()) << "the other tile is dropped";
  EXPECT_TRUE(done(*extra)) << "what was out is welcome";
  EXPECT_EQ(schedule.frames_in_flight(), 0u);
}

// A resting view is requested every second, and extra rays are cast for it in between.
TEST_F(Steered, ExtraTilesOfAViewThatStaysAreKept) {
  look(5, 1);
  answer(ask_extra(), kTwoTiles);
  const auto extra = schedule.lease("a", now);
  ASSERT_TRUE(extra);
  now += kExtraPatience_s + 0.01;
  look(5, 2);
  const auto left = leases();
  ASSERT_EQ(left.size(), 1u);
  EXPECT_TRUE(left[0].extra);
  look(6, 1);
  EXPECT_TRUE(done(*extra));
  EXPECT_TRUE(done(left[0]));
  EXPECT_EQ(schedule.frames_in_flight(), 0u);
}

TEST_F(Steered, AHeadThatRestsGetsMoreRaysInAnExtraFrame) {
  look(5, 1);
  const auto moving = ask_extra();
  answer(moving, {});
  look(5, 2);
  const auto still = ask_extra();
  EXPECT_TRUE(still.still);
  EXPECT_EQ(still.most_rays, kStillExtras * moving.most_rays);
}

TEST_F(Steered, LostLeasesOfADroppedExtraFrameEndIt) {
  look(5, 1);
  answer(ask_extra(), kTwoTiles);
  ASSERT_TRUE(schedule.lease("a", now));
  now += kExtraPatience_s + 0.01;
  look(5, 2, 0.1);
  EXPECT_EQ(schedule.leases_of("a"), 1u);
  EXPECT_EQ(schedule.release_sampler("a"), 1);
  EXPECT_EQ(schedule.frames_in_flight(), 0u);
  EXPECT_TRUE(asks_extra());
}

// The packer searches beyond a view only when it has time.
TEST_F(Steered, ExtraRaysAreWaitedForLongerThanViews) {
  look(5, 1);
  const auto question = ask_extra();
  now += kLongestPatience_s + 0.1;
  schedule.give_up_plans(now);
  EXPECT_TRUE(schedule.take_plan_rows().size() == 1) << "of the view alone";
  answer(question, kTwoTiles);
  for (const auto& l : leases()) EXPECT_TRUE(done(l));
  ask_extra();
  now += kExtraAnswer_s + 0.1;
  schedule.give_up_plans(now);
  EXPECT_EQ(schedule.take_plan_rows().back().outcome, Outcome::kLate);
  EXPECT_FALSE(asks_extra()) << "until there is another view";
  EXPECT_TRUE(schedule.steered(now));
}

// A moving viewer requests the next view while one is sampled: there is never an idle time.
TEST_F(Steered, EverySecondViewOfAMovingHeadIsFollowedByAnExtraFrame) {
  int extras = 0;
  for (uint64_t id = 1; id <= 10; ++id) {
    const auto view = ask(5, id, 0.01 * double(id));
    EXPECT_FALSE(asks_extra()) << "not before the packer knows the view";
    answer(view, kTwoTiles);
    schedule.request_view(request(5, id + 1, 0.01 * double(id + 1)));
    schedule.begin_extra({1}, now);
    for (const auto& question : schedule.take_questions()) {
      EXPECT_TRUE(question.extra);
      EXPECT_EQ(question.request.value, id);
      ++extras;
      answer(question, kTwoTiles);
    }
    auto all = leases();
    EXPECT_EQ(all.size(), id % 2 ? 2u : 4u);
    for (const auto& l : all) EXPECT_TRUE(done(l));
  }
  EXPECT_EQ(extras, 5);
  EXPECT_EQ(schedule.frames_completed(), 10u);
}

TEST_F(Steered, AnExtraAnswerOfAnOlderViewDoesNotEndTheNewer) {
  look(5, 1, 0.1);
  const auto question = ask_extra();
  look(5, 2, 0.2);
  answer(question, {});
  EXPECT_EQ(ask_extra().request.value, 2u);
}

TEST_F(Steered, PackersThatAreSlowAreWaitedForLonger) {
  for (uint64_t id = 1; id <= 20; ++id) {
    const auto question = ask(5, id, 0.01 * double(id));
    now += 0.5;
    schedule.give_up_plans(now);
    answer(question, {});
  }
  EXPECT_EQ(schedule.frames_completed(), 20u);
  ask(5, 21);
  now += 1.9;
  schedule.give_up_plans(now);
  EXPECT_TRUE(leases().empty());
  now += 0.2;
  schedule.give_up_plans(now);
  EXPECT_EQ(leases().size(), 8u);
}

TEST_F(Steered, ALostMaskedLeaseIsLeasedAgainWithItsMask) {
  answer(ask(5, 1), kTwoTiles);
  const auto first = schedule.lease("a", now);
  ASSERT_TRUE(first);
  EXPECT_EQ(schedule.release_sampler("a"), 1);
  const auto again = schedule.lease("b", now);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->tile, first->tile);
  EXPECT_EQ(again->mask, first->mask);
  EXPECT_EQ(again->rays, first->rays);
  EXPECT_NE(again->lease, first->lease);
}

TEST_F(Steered, ExtraFramesOfViewersTakeTurns) {
  look(5, 1), look(6, 1);
  for (const uint64_t viewer : {5, 6, 5, 6}) {
    const auto question = ask_extra();
    EXPECT_EQ(question.viewer.value, viewer);
    answer(question, kTwoTiles);
    for (const auto& l : leases()) done(l);
  }
  schedule.forget_viewer({5});
  for (int i = 0; i < 2; ++i) {
    const auto question = ask_extra();
    EXPECT_EQ(question.viewer.value, 6u);
    answer(question, kTwoTiles);
    for (const auto& l : leases()) done(l);
  }
}

TEST_F(Steered, RoundsGoOnFromViewToView) {
  look(5, 1, 0.1);
  answer(ask_extra(), {});
  look(5, 2, 0.1);
  const auto second = ask_extra();
  EXPECT_EQ(second.round, 1u);
  answer(second, {});
  look(5, 3, 0.2);
  const auto third = ask_extra();
  EXPECT_EQ(third.round, 2u);
  answer(third, {});
  look(6, 1, 0.2);
  EXPECT_EQ(ask_extra().round, 0u) << "another viewer";
}

TEST_F(Steered, DroppedFramesTakeTheirPlansWithThem) {
  const auto question = ask(5, 1);
  schedule.drop_frames();
  EXPECT_EQ(schedule.views_in_flight(), 0u);
  EXPECT_TRUE(schedule.view_waiting());
  answer(question, kTwoTiles);
  EXPECT_TRUE(leases().empty()) << "the plan of a frame that is dropped";
  EXPECT_TRUE(schedule.begin_view({2}, false, now));
  const auto again = asked();
  EXPECT_NE(again.frame, question.frame);
  EXPECT_EQ(again.epoch.value, 2u);
  EXPECT_FALSE(again.still);
}

TEST_F(Steered, APlanOfAnotherCameraIsRefusedAndTheViewSampledWhole) {
  wire::Plan plan = plan_of(ask(5, 1), kTwoTiles);
  plan.camera.width *= 2;
  const Status s = schedule.take_plan(plan, now);
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().text.find("camera"), std::string::npos);
  EXPECT_EQ(leases().size(), 8u);
  plan.epoch = {9};
  EXPECT_TRUE(schedule.take_plan(plan, now)) << "nobody asked";
}

TEST_F(Steered, APlanWhoseMasksAreNoneIsRefusedAndTheViewSampledWhole) {
  const Tile good = masked({64, 64, 64, 64}, 40);
  Tile nonsense = good, cut = good, miscounted = good;
  nonsense.mask.assign(3, 0xffffffff);
  cut.mask.pop_back();
  miscounted.rays = 41;
  uint64_t id = 0;
  for (const Tile& bad : {nonsense, cut, miscounted}) {
    ++id;
    const auto question = ask(5, id, 0.01 * double(id));
    const Status s = schedule.take_plan(plan_of(question, {kTwoTiles[1], bad}), now);
    ASSERT_FALSE(s) << id;
    EXPECT_NE(s.error().text.find("tile 1"), std::string::npos) << s.error().text;
    const auto l = leases();
    EXPECT_EQ(l.size(), 8u);
    for (const auto& lease : l) EXPECT_TRUE(lease.mask.empty() && done(lease));
    EXPECT_EQ(schedule.frames_completed(), id);
    EXPECT_EQ(schedule.take_plan_rows().back().outcome, Outcome::kFull);
  }
  // Extra rays that cannot be cast are not asked for again.
  const Status s = schedule.take_plan(plan_of(ask_extra(), {miscounted}), now);
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().text.find("41 rays, its mask has 40"), std::string::npos) << s.error().text;
  EXPECT_TRUE(leases().empty());
  EXPECT_FALSE(asks_extra());
  look(5, 9);
  const auto question = ask_extra();
  const Tile large = masked({0, 0, 4096, 2048}, 1);
  wire::Plan huge = plan_of(question, {large, large, large});
  huge.camera.width = huge.camera.height = 8192;
  const Status refused = schedule.take_plan(huge, now);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("masks of 25165824 pixels, limit 16777216"), std::string::npos)
      << refused.error().text;
}

// A sampler that cannot read a mask casts all of its tile, and reports that.
TEST_F(Steered, ATileThatWasSampledWholeCostsAllItsPixels) {
  answer(ask(5, 1), {kTwoTiles[0]});
  auto l = leases().at(0);
  l.rays = 64 * 64;
  EXPECT_TRUE(done(l, 1e-6 * 64 * 64));
  EXPECT_NEAR(schedule.costs().pixel_s("a"), 1e-6, 1e-12);
  answer(ask(5, 2, 0.1), {kTwoTiles[0]});
  l = leases().at(0);
  l.rays = ~uint64_t{0};  // more than the tile has
  EXPECT_TRUE(done(l, 1e-6 * 64 * 64));
  EXPECT_NEAR(schedule.costs().pixel_s("a"), 1e-6, 1e-12);
}

TEST_F(Steered, CostsFollowTheRays) {
  answer(ask(5, 1), kTwoTiles);
  for (const auto& l : leases()) done(l, 1e-6 * double(l.rays));
  EXPECT_NEAR(schedule.costs().pixel_s("a"), 1e-6, 1e-12);
  const auto question = ask(5, 2, 0.1);
  EXPECT_NEAR(double(question.tile_rays), 12'000, 1) << "three times 4 ms: one sampler need not share them";
  answer(question, {});
  EXPECT_NEAR(double(ask_extra().most_rays), 50'000, 1) << "50 ms of one sampler";
}

TEST_F(Steered, WithoutSteeringNothingIsAsked) {
  schedule.set_cut({});
  schedule.request_view(request(5, 1));
  ASSERT_TRUE(schedule.begin_view({1}, false, now));
  EXPECT_TRUE(schedule.take_questions().empty());
  EXPECT_EQ(leases().size(), 8u);
  EXPECT_FALSE(asks_extra());
}

// ---- the master around it -------------------------------------------------------------------------------------------

class SteeredMaster : public testing::Test {
 protected:
  void SetUp() override { hello("data", 1), hello("packer", 2), hello("sampler", 3), hello("viewer", 5); }
  void hello(const std::string& role, uint64_t instance, const std::string& peer = {}) {
    wire::Hello h;
    h.role = role;
    h.name = peer.empty() || role != "viewer" ? role : peer;
    h.instance = {instance};
    if (role == "data") h.facts = {{"kind", "mesh"}}, h.box_room = {{-1, -1, -1}, {1, 1, 1}};
    core.on(peer.empty() ? role : peer, h, now);
  }
  template <class M>
  std::vector<M> sent(const std::string& peer) {
    for (auto& out : core.take_outgoing()) outbox.push_back(std::move(out));
    std::vector<M> messages;
    std::erase_if(outbox, [&](const Outgoing& o) {
      if (o.peer != peer || o.type != M::kName) return false;
      messages.push_back(*wire::decode<M>(std::as_bytes(std::span(o.body))));
      return true;
    });
    return messages;
  }
  wire::PlanRequest asked(const std::string& packer = "packer") {
    const auto questions = sent<wire::PlanRequest>(packer);
    EXPECT_EQ(questions.size(), 1u);
    return questions.empty() ? wire::PlanRequest{} : questions[0];
  }

  double now = 1;
  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{{}, {42}, *record};
  std::vector<Outgoing> outbox;
};

TEST_F(SteeredMaster, AsksThePackerThoughNoSamplerIsIdle) {
  core.on("viewer", request(5, 1), now);
  const auto question = asked();
  EXPECT_TRUE(core.settings().steering);
  ASSERT_TRUE(core.on("viewer", plan_of(question, {}), now)) << "of a viewer: not heard";
  EXPECT_EQ(core.counters().at("frames_completed"), 0);
  ASSERT_TRUE(core.on("packer", plan_of(question, {}), now));
  EXPECT_EQ(core.counters().at("frames_completed"), 1) << "and the view needed none";
  const auto summary = record->summary({}, {});
  EXPECT_EQ(summary["rays_cast"], 0);
  EXPECT_EQ(summary["rays_full"], 256 * 128);
  EXPECT_EQ(summary["rays_saved"], 1.0);
  const auto extra = asked();
  EXPECT_TRUE(extra.extra);
  core.on("sampler", wire::LeaseRequest{}, now);
  ASSERT_TRUE(core.on("packer", plan_of(extra, kTwoTiles), now));
  ASSERT_EQ(sent<wire::Lease>("sampler").size(), 1u);
}

TEST_F(SteeredMaster, APlanThatIsRefusedNamesThePacker) {
  core.on("sampler", wire::LeaseRequest{}, now);
  core.on("viewer", request(5, 1), now);
  Tile bad = kTwoTiles[0];
  bad.mask.assign(1, 77);
  const Status s = core.on("packer", plan_of(asked(), {bad}), now);
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().text.find("packer: the plan of frame "), std::string::npos) << s.error().text;
  const auto leases = sent<wire::Lease>("sampler");
  ASSERT_EQ(leases.size(), 1u);
  EXPECT_TRUE(leases[0].mask.empty());
}

TEST_F(SteeredMaster, ANewPackerIsAskedAnew) {
  core.on("viewer", request(5, 1), now);
  const auto question = asked();
  hello("packer", 20, "other");
  const auto again = asked("other");
  EXPECT_EQ(again.request.value, 1u);
  EXPECT_NE(again.frame, question.frame);
  ASSERT_TRUE(core.on("other", plan_of(question, {}), now));
  EXPECT_EQ(core.counters().at("frames_completed"), 0) << "the answer to the old one's question";
  ASSERT_TRUE(core.on("other", plan_of(again, {}), now));
  EXPECT_EQ(core.counters().at("frames_completed"), 1);
}

TEST_F(SteeredMaster, ASilentPackerCostsAViewTheDeadline) {
  core.on("sampler", wire::LeaseRequest{}, now);
  core.on("viewer", request(5, 1), now);
  asked();
  EXPECT_TRUE(sent<wire::Lease>("sampler").empty());
  now += kLeastPatience_s + 0.01;
  core.tick(now);
  const auto leases = sent<wire::Lease>("sampler");
  ASSERT_EQ(leases.size(), 1u);
  EXPECT_TRUE(leases[0].mask.empty());
  const auto summary = record->summary({}, {});
  EXPECT_EQ(summary["plans_late"], 1);
}

TEST_F(SteeredMaster, WithoutSamplersOrPackerNothingIsAsked) {
  core.on("packer", wire::Goodbye{}, now);
  core.undeliverable("packer");
  core.on("viewer", request(5, 1), now);
  EXPECT_TRUE(sent<wire::PlanRequest>("packer").empty());
  core.undeliverable("sampler");
  hello("packer", 21, "other");
  EXPECT_TRUE(sent<wire::PlanRequest>("other").empty());
  hello("sampler", 30, "s");
  EXPECT_EQ(sent<wire::PlanRequest>("other").size(), 1u);
}

// Viewers come and go, under new names and over old connections, while other scenes are shown, in the middle of plans.
TEST_F(SteeredMaster, NothingIsRememberedOfViewersThatLeft) {
  volume::Session other;  // a scene of another kind
  other.grid.size = {16, 16, 24};
  other.grid.index_to_room[0][0] = other.grid.index_to_room[1][1] = other.grid.index_to_room[2][2] = 0.05;
  other.levels = {0, 1, 256};
  other.range = {.lo = 0, .hi = 255, .typical_lo = 10, .typical_hi = 200};
  other.transfer.points = {{.value = 0, .opacity = 0}, {.value = 255, .opacity = 0.5}};
  wire::Hello volume{.role = "data", .name = "volume", .instance = {7}, .endpoints = {{"voxels", "v"}}};
  volume.parameters = volume::to_parameters(other), volume.facts = volume::to_facts(other);
  volume.facts["kind"] = "volume";
  volume.box_room = other.grid.box_room();
  uint64_t instance = 1000;
  int remembered = 0;
  const auto look = [&](const std::string& peer) {
    hello("viewer", ++instance, peer);
    core.on(peer, request(instance, 1), now);
    for (const auto& question : sent<wire::PlanRequest>("packer")) {
      if (instance % 3 == 0) continue;
      EXPECT_TRUE(core.on("packer", plan_of(question, {}), now));
    }
    now += 2 * kLeastPatience_s;  // the other plans are given up
    core.tick(now);
    remembered += core.figures().viewers == 1;
    EXPECT_LE(core.figures().viewers, 1u);
  };
  for (int i = 0; i < 200; ++i) {
    const std::string peer = "v" + std::to_string(i);
    look(peer);
    if (i % 4 == 0) look(peer);  // after a restart
    switch (i % 3) {
      case 0:
        core.on(peer, wire::Goodbye{{instance}}, now);
        break;
      case 1:
        core.undeliverable(peer);
        break;
      default:  // while a volume is shown
        core.on("volume", volume, now);
        core.undeliverable(peer);
        hello("data", 10000 + uint64_t(i), "data" + std::to_string(i));
    }
    EXPECT_EQ(core.figures().viewers, 0u) << i;
    for (const char* p : {"packer", "sampler"}) core.on(p, wire::StatusReport{}, now);
  }
  EXPECT_GT(remembered, 100) << "while they were here";
}

TEST_F(SteeredMaster, TheSceneDecides) {
  MasterOptions o;
  const auto steers = [&](scene::Kind kind) { return settings(o, kind).steering; };
  EXPECT_TRUE(steers(scene::Kind::kMesh));
  EXPECT_TRUE(steers(scene::Kind::kJulia));
  EXPECT_FALSE(steers(scene::Kind::kVolume));
  o.settings.keep_redundant = true;
  EXPECT_FALSE(steers(scene::Kind::kMesh));
  o.settings = {.steering = false};
  EXPECT_FALSE(steers(scene::Kind::kJulia));
}

}  // namespace
}  // namespace telesplat::master
