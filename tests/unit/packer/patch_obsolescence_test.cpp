// Order in which redundant patches go: scores, limits, ties; and the state of replicas that join late.
#include "services/packer/points/obsolescence.h"

#include <gtest/gtest.h>

#include <set>

#include <algorithm>

#include "common/points/mosaic_builder.h"
#include "tests/support/packer_scenes.h"

namespace telesplat::packer {
namespace {

constexpr PatchLimits kNoLimits{.patches_per_cluster = 0};

points::Mosaic mosaic(uint64_t sequence, uint64_t frame, float pixel_range, uint32_t points = 10) {
  points::MosaicBuilder builder({sequence}, {frame}, {points, points, points});
  for (auto* plane : {builder.x, builder.y, builder.z, builder.normal}) std::fill_n(plane, points, uint16_t{0});
  std::fill_n(builder.colour, points, 0u);
  return builder.finish(pixel_range, {0, 0, 1});
}

using Keys = std::vector<PatchKey>;

TEST(PatchObsolescence, WhatNobodyDrewForLongIsObsolete) {
  PatchObsolescence o;
  o.added(7, mosaic(1, 1, 16), 0);
  o.added(7, mosaic(2, 2, 16), 1);
  o.added(3, mosaic(3, 2, 16), 1);
  PatchLimits limits = kNoLimits;
  EXPECT_EQ(o.choose(limits, 1e9), Keys{}) << "zero means never";
  limits.obsolete_after_s = 5;
  EXPECT_EQ(o.choose(limits, 5.0), Keys{});
  EXPECT_EQ(o.choose(limits, 5.1), (Keys{{7, 1}}));
  o.accessed({7, 1}, 4);
  o.accessed({7, 9}, 50);  // no such patch
  o.accessed(8, 50);       // no such cluster
  EXPECT_EQ(o.choose(limits, 6.5), (Keys{{3, 2}, {7, 2}}));
  o.accessed({7, 1}, 2);  // time does not run backwards
  o.accessed(7, 3);       // all of the cluster
  EXPECT_EQ(o.choose(limits, 8.5), (Keys{{3, 2}, {7, 2}}));
  EXPECT_EQ(o.choose(limits, 9.5), (Keys{{3, 2}, {7, 1}, {7, 2}}));
  for (const PatchKey& key : o.choose(limits, 9.5)) o.forgotten(key);
  EXPECT_EQ(o.choose(limits, 1e9), Keys{});
}

TEST(PatchObsolescence, ScoresWeighAgeAndRate) {
  PatchObsolescence o;
  o.added(1, mosaic(1, 1, 16), 10);  // fine, drawn 2 s ago
  o.added(1, mosaic(2, 2, 4), 12);   // two halvings coarser, drawn now
  o.added(1, mosaic(3, 3, 16), 12);
  PatchLimits limits{.patches_per_cluster = 2};
  EXPECT_EQ(o.choose(limits, 12), (Keys{{1, 2}})) << "8 against 2";
  o.accessed({1, 2}, 20), o.accessed({1, 3}, 20);
  EXPECT_EQ(o.choose(limits, 20), (Keys{{1, 1}})) << "8 against 10";
  limits.patches_per_cluster = 1;
  EXPECT_EQ(o.choose(limits, 20), (Keys{{1, 1}, {1, 2}}));
  limits.patches_per_cluster = 0;
  EXPECT_EQ(o.choose(limits, 20), Keys{});
}

TEST(PatchObsolescence, TheBestRangeIsThatOfWhatIsNotObsolete) {
  PatchObsolescence o;
  o.added(1, mosaic(1, 1, 64), 0);  // finest, but obsolete
  o.added(1, mosaic(2, 2, 8), 8);   // 0 + rate 0 beside the others; 3 halvings beside the finest
  o.added(1, mosaic(3, 3, 8), 7);
  const PatchLimits limits{.obsolete_after_s = 5, .patches_per_cluster = 1};
  EXPECT_EQ(o.choose(limits, 8), (Keys{{1, 1}, {1, 3}}));
}

TEST(PatchObsolescence, TooManyPointsAreForgottenDownToNineTenths) {
  PatchObsolescence o;
  for (uint32_t i = 0; i < 20; ++i) o.added(i, mosaic(i + 1, 1, 16, 50), i);  // 1000 points; the first are the oldest
  o.added(19, mosaic(30, 2, 1, 100), 19);                                     // four halvings: 16 s
  o.accessed({0, 1}, 25);
  PatchLimits limits = kNoLimits;
  limits.max_points = 1100;
  EXPECT_EQ(o.choose(limits, 20), Keys{}) << "as many as there may be";
  limits.max_points = 1000;  // down to 900: 200 go
  // Ages at 20 s: 1 -> 19, 2 -> 18, 3 -> 17, and the coarse one 17 as well, which is newer: after 3.
  EXPECT_EQ(o.choose(limits, 20), (Keys{{1, 1}, {2, 1}, {3, 1}, {19, 2}}));
  limits.max_points = 1;
  EXPECT_EQ(o.choose(limits, 20).size(), 21u);
  // Equal scores and ages: by key.
  PatchObsolescence equal;
  for (uint32_t key : {5u, 2u, 9u, 4u}) equal.added(key, mosaic(1, 1, 16), 0);
  limits.max_points = 30;
  EXPECT_EQ(equal.choose(limits, 3), (Keys{{2, 1}, {4, 1}}));
}

TEST(PatchObsolescence, MosaicsOfOneFrameAreOnePatch) {
  PatchObsolescence o;
  o.added(1, mosaic(1, 5, 16), 0);
  o.added(1, mosaic(2, 6, 16), 1);
  o.added(1, mosaic(3, 5, 16), 2);  // the next block of frame 5
  const PatchLimits limits{.patches_per_cluster = 1};
  EXPECT_EQ(o.choose(limits, 3), (Keys{{1, 6}})) << "frame 5 got points later";
  o.forgotten({1, 6});
  EXPECT_EQ(o.choose(limits, 3), Keys{});
}

// ---- through the core ----

Config keep_config() {
  Config config = test::packer_config();
  config.redundancy = Redundancy::kKeep;
  config.model.depth = 3;
  return config;
}

geometry::Camera camera(double turn, int width = 96, int height = 64) {
  return test::scene_camera({0.7 * std::cos(turn), 0.4, 0.7 * std::sin(turn)}, width, height);
}

std::vector<Event> submit_all(PackerCore& core, std::vector<SampledTile> tiles, double now_s) {
  std::vector<Event> out;
  for (SampledTile& tile : tiles) {
    auto event = core.submit(std::move(tile), now_s);
    EXPECT_TRUE(event.ok() && event->has_value());
    out.push_back(std::move(**event));
  }
  return out;
}

TEST(KeepMode, StreamsArePublishedAsTheyCame) {
  for (const bool keep : {true, false}) {
    Config config = keep_config();
    if (!keep) config.redundancy = Redundancy::kEliminate;
    PackerCore core(config, test::kEpoch);
    auto tile = test::sampled_frame({1}, camera(0), 96)[0];
    const auto stream = std::make_shared<const std::vector<uint8_t>>(codec::encode(tile.image));
    const auto event = core.submit(tile, 0, stream);
    ASSERT_TRUE(event.ok() && event->has_value());
    EXPECT_EQ((*event)->blob == stream, keep);
    if (keep) EXPECT_EQ(*(*event)->blob, *stream);
    EXPECT_EQ((*event)->kept, (*event)->samples) << "nothing is redundant yet";
  }
}

TEST(KeepMode, CoarsePatchesGoFirst) {
  Config config = keep_config();
  config.patches_per_cluster = 2;
  PackerCore core(config, test::kEpoch);
  auto coarse = test::sampled_frame({1}, geometry::subsample(camera(0), 4), 96);
  for (auto& t : coarse) t.step = 4;
  submit_all(core, coarse, 0);
  submit_all(core, test::sampled_frame({2}, camera(0), 32), 0);
  EXPECT_TRUE(core.tick(1).empty());
  submit_all(core, test::sampled_frame({3}, camera(0.01), 32), 1);
  const auto events = core.tick(1);
  ASSERT_EQ(events.size(), 1u);
  ASSERT_EQ(events[0].frames.size(), events[0].clusters.size());
  for (const uint32_t frame : events[0].frames) EXPECT_EQ(frame, 1u | points::kProvisionalTag);
  EXPECT_GT(core.statistics().patches_forgotten, 10u);
  EXPECT_EQ(core.statistics().patches_forgotten, events[0].clusters.size());
  for (const auto& [key, cluster] : core.model().clusters()) {
    std::vector<uint32_t> frames;
    for (const auto& m : cluster->mosaics) frames.push_back(m.frame_tag());
    std::sort(frames.begin(), frames.end());
    EXPECT_LE(std::unique(frames.begin(), frames.end()) - frames.begin(), 2);
  }
}

TEST(EliminateMode, ACoarsePassLeavesNoTraceBehindItsCompleteFrame) {
  Config config = test::packer_config();
  config.model.compact = true;
  PackerCore core(config, test::kEpoch), plain(config, test::kEpoch);
  test::Replica replica(config.model);
  const auto apply = [&](const std::vector<Event>& events) {
    for (const Event& e : events) replica.apply(e);
  };
  auto coarse = test::sampled_frame({1}, geometry::subsample(camera(0), 4), 16);
  auto fine = test::sampled_frame({2}, camera(0), 48);
  for (auto& t : coarse) t.step = 4, t.request = {1};
  for (auto& t : fine) t.request = {1};
  apply(submit_all(core, std::move(coarse), 0));
  const uint64_t coarse_points = core.model().points();
  submit_all(plain, fine, 0);
  apply(submit_all(core, std::move(fine), 0));
  EXPECT_EQ(core.model().points(), plain.model().points() + coarse_points) << "all of the complete frame is packed";
  apply(core.forget_superseded());
  EXPECT_GT(coarse_points, 50u);
  EXPECT_EQ(core.model().points(), plain.model().points());
  for (const auto& [key, cluster] : core.model().clusters())
    for (const points::Mosaic& m : cluster->mosaics) EXPECT_FALSE(m.provisional());
  EXPECT_EQ(replica.model().digest(), core.model().digest());
  test::Replica late(config.model);
  late.catch_up(core);
  EXPECT_EQ(late.model().digest(), core.model().digest());
}

TEST(EliminateMode, WhatARestingHeadWasShownGoesWhenItHasMovedOn) {
  Config config = test::packer_config();
  config.model.compact = true;
  PackerCore core(config, test::kEpoch), plain(config, test::kEpoch);
  test::Replica replica(config.model);
  const auto apply = [&](const std::vector<Event>& events) {
    for (const Event& e : events) replica.apply(e);
  };
  const auto fine = [&](uint64_t id, geometry::Camera view) {
    view.width *= 2, view.height *= 2;
    auto tiles = test::sampled_frame({id}, view, 48);
    for (auto& t : tiles) t.extra = true, t.missed.reset(t.rect.width, t.rect.height);
    return tiles;
  };
  for (PackerCore* c : {&core, &plain}) {
    const auto events = submit_all(*c, test::sampled_frame({1}, camera(0), 48), 0);
    if (c == &core) apply(events);
  }
  const uint64_t of_view = core.model().points();
  for (uint64_t id = 2; id < 5; ++id) {
    const auto events = submit_all(core, fine(id, camera(0)), 0);
    for (const Event& e : events) EXPECT_EQ(e.rest, 1u);
    apply(events);
    apply(submit_all(core, test::sampled_frame({id + 10}, camera(0), 48), 0));
    EXPECT_TRUE(core.forget_superseded().empty()) << "it rests";
  }
  EXPECT_GT(core.model().points(), 3 * of_view);
  EXPECT_EQ(replica.model().digest(), core.model().digest());

  // The first view from elsewhere keeps the same points with and without a rest before.
  std::vector<Event> moved = submit_all(core, test::sampled_frame({20}, camera(0.02), 48), 1);
  const std::vector<Event> expected = submit_all(plain, test::sampled_frame({20}, camera(0.02), 48), 1);
  ASSERT_EQ(moved.size(), expected.size());
  for (size_t i = 0; i < moved.size(); ++i) EXPECT_EQ(moved[i].kept, expected[i].kept);
  apply(moved);
  const auto forgets = core.forget_superseded();
  ASSERT_EQ(forgets.size(), 1u);
  EXPECT_EQ(forgets[0].frames.size(), forgets[0].clusters.size());
  apply(forgets);
  EXPECT_EQ(core.model().points(), plain.model().points());
  EXPECT_EQ(replica.model().digest(), core.model().digest());
  test::Replica late(config.model);
  late.catch_up(core);
  EXPECT_EQ(late.model().digest(), core.model().digest());
  EXPECT_EQ(core.log_bytes() < 2 * plain.log_bytes(), true) << "and its patches go with them";

  // Another rest has another number; a head that rests elsewhere at once also ends the old one.
  for (const Event& e : submit_all(core, fine(30, camera(0.02)), 2)) EXPECT_EQ(e.rest, 2u);
  for (const Event& e : submit_all(core, fine(31, camera(0.04)), 2)) EXPECT_EQ(e.rest, 3u);
  EXPECT_EQ(core.forget_superseded().size(), 1u);
  // Late tiles of the old rest do not end the new one.
  const uint64_t before = core.model().points();
  auto tiles = fine(32, camera(0.02));
  for (auto& t : tiles) t.request = {1030};
  submit_all(core, std::move(tiles), 2);
  EXPECT_EQ(core.model().points(), before);
  for (const Event& e : submit_all(core, fine(33, camera(0.04)), 2)) EXPECT_EQ(e.rest, 3u);
  EXPECT_TRUE(core.forget_superseded().empty());
}

TEST(KeepMode, ACompleteFrameSupersedesItsCoarsePass) {
  PackerCore core(keep_config(), test::kEpoch);
  test::Replica replica(keep_config().model);
  const auto apply = [&](const std::vector<Event>& events) {
    for (const Event& e : events) replica.apply(e);
  };
  // Coarse and complete frames of two requests in turns, in four tiles each; the complete one of the first comes last.
  const auto frame = [&](uint64_t id, uint64_t request, uint32_t step) {
    const geometry::Camera full = camera(0.01 * double(request));
    auto tiles = test::sampled_frame({id}, step > 1 ? geometry::subsample(full, int(step)) : full, step > 1 ? 16 : 48);
    for (auto& t : tiles) t.step = step, t.request = {request};
    return tiles;
  };
  apply(submit_all(core, frame(1, 1, 4), 0));
  apply(submit_all(core, frame(3, 2, 4), 0));
  EXPECT_TRUE(core.forget_superseded().empty());
  auto fine = frame(2, 1, 1);
  auto last = std::move(fine.back());
  fine.pop_back();
  apply(submit_all(core, std::move(fine), 0));
  EXPECT_TRUE(core.forget_superseded().empty()) << "not complete yet";
  apply({**core.submit(std::move(last), 0)});
  const auto events = core.forget_superseded();
  ASSERT_EQ(events.size(), 1u);
  apply(events);
  EXPECT_TRUE(core.forget_superseded().empty());
  std::set<uint32_t> left;
  for (const auto& [key, cluster] : core.model().clusters())
    for (const auto& m : cluster->mosaics) left.insert(m.frame_tag());
  EXPECT_EQ(left, (std::set<uint32_t>{2, 3 | points::kProvisionalTag}))
      << "the other request's coarse pass is all there is of it";
  EXPECT_EQ(replica.model().digest(), core.model().digest());
  test::Replica late(keep_config().model);
  late.catch_up(core);
  EXPECT_EQ(late.model().digest(), core.model().digest());
}

TEST(KeepMode, WhatIsDrawnStays) {
  Config config = keep_config();
  config.obsolete_after_s = 5;
  PackerCore core(config, test::kEpoch);
  submit_all(core, test::sampled_frame({1}, camera(0), 32), 0);
  submit_all(core, test::sampled_frame({2}, camera(0.5), 32), 0);
  // One patch of each cluster is drawn; for every third cluster the report does not say which.
  std::vector<points::ClusterKey> drawn, some;
  std::vector<uint32_t> frames;
  for (const auto& [key, cluster] : core.model().clusters()) {
    if (key % 3 == 0) {
      some.push_back(key);
    } else {
      drawn.push_back(key);
      frames.push_back(cluster->mosaics.back().frame_tag());
    }
  }
  core.accessed(drawn, 4, frames);
  core.accessed(some, 4);
  core.accessed({}, 8);  // a viewer reports
  core.tick(8);
  const points::PointModel& model = core.model();
  EXPECT_EQ(model.clusters().size(), drawn.size() + some.size());
  for (size_t i = 0; i < drawn.size(); ++i)
    for (const auto& m : model.find(drawn[i])->mosaics) EXPECT_EQ(m.frame_tag(), frames[i]);
  core.accessed({}, 9.5);
  core.tick(9.5);
  EXPECT_EQ(model.points(), 0u);
  EXPECT_TRUE(core.events_since({0}).empty()) << "patches without points are left out";
}

TEST(KeepMode, TheLogIsBounded) {
  Config config = keep_config();
  config.patches_per_cluster = 0;
  config.max_log_bytes = 100000;
  PackerCore core(config, test::kEpoch);
  bool forgot = false;
  for (uint64_t frame = 1; frame <= 20; ++frame) {
    const double now_s = static_cast<double>(frame);
    submit_all(core, test::sampled_frame({frame}, camera(0.5 * now_s), 32), now_s);
    forgot |= !core.tick(now_s).empty();
    EXPECT_LE(core.log_bytes(),
              config.max_log_bytes + 8 * core.statistics().patches_forgotten + 40 * core.model().clusters().size())
        << "the limit, and what it takes to know what lies where";
    EXPECT_GT(core.model().points(), 0u) << "the newest stay";
  }
  EXPECT_TRUE(forgot);
  test::Replica late(config.model);
  late.catch_up(core);
  EXPECT_EQ(late.model().digest(), core.model().digest());
}

// A replica that stopped too long ago must begin anew; no other must.
TEST(EventLogOfPatches, KnowsHowFarItRemembers) {
  const points::ModelConfig config = keep_config().model;
  points::PointModel model(config);
  EventLog log(100);
  uint64_t sequence = 0;
  const auto add = [&](uint64_t frame) {
    auto tile = test::sampled_frame({frame}, camera(0.1 * double(frame)), 96)[0];
    Event event;
    event.sequence = {++sequence}, event.frame = tile.frame, event.camera = tile.camera, event.rect = tile.rect;
    event.blob = std::make_shared<const std::vector<uint8_t>>(codec::encode(tile.image));
    auto patch = points::prepare_patch(config, event.sequence, tile.camera, tile.rect, tile.image, tile.frame);
    std::vector<points::ClusterKey> clusters;
    for (const auto& [key, mosaic] : patch.mosaics) clusters.push_back(key);
    log.add_patch(event, clusters);
    model.insert(std::move(patch));
  };
  std::vector<Event> forgets;
  const auto forget_half_of = [&](uint32_t frame) {
    Event& event = forgets.emplace_back();
    event.sequence = {++sequence}, event.kind = Event::Kind::kForget;
    for (const auto& [key, cluster] : model.clusters())
      if ((key ^ key >> 10) % 2) event.clusters.push_back(key), event.frames.push_back(frame);
    log.add_patch_forget(event, model.forget(event.clusters, event.frames));
  };
  size_t forgotten = 0;
  for (uint64_t frame = 1; frame <= 12; ++frame) {
    add(frame);
    forget_half_of(static_cast<uint32_t>(frame));
    forgotten += forgets.back().clusters.size();
  }
  ASSERT_GT(forgotten, 200u);
  EXPECT_TRUE(log.remembers({0}));
  EXPECT_TRUE(log.remembers({sequence}));
  size_t kept = 0;
  bool remembers = true;
  for (size_t i = forgets.size(); i-- > 0;) {  // newest first
    kept += forgets[i].clusters.size();
    if (kept > 100) remembers = false;
    EXPECT_EQ(log.remembers({forgets[i].sequence.value - 1}), remembers) << "forget " << i;
  }
  EXPECT_FALSE(remembers);
  // From the beginning the answer is complete.
  test::Replica late(config);
  for (const Event& event : log.since({0})) late.apply(event);
  EXPECT_EQ(late.model().digest(), model.digest());
  // After a new epoch every replica can follow.
  Event epoch;
  epoch.kind = Event::Kind::kEpoch, epoch.sequence = {++sequence};
  log.add_epoch(epoch);
  EXPECT_TRUE(log.remembers({1}));
}

}  // namespace
}  // namespace telesplat::packer
