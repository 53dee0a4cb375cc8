// The packer's core: tiles in, events out, and the state that it keeps.
#include "services/packer/points/packer_core.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <tuple>

#include "tests/support/packer_scenes.h"

namespace telesplat::packer {
namespace {

using test::kEpoch;
using test::packer_config;
using test::sampled_frame;

geometry::Camera camera(double turn = 0) {
  return test::scene_camera({0.7 * std::cos(turn), 0.4, 0.7 * std::sin(turn)}, 320, 200);
}

// Submits every tile of a frame; each must be taken.
std::vector<Event> submit_all(PackerCore& core, std::vector<SampledTile> tiles, double now_s = 0) {
  std::vector<Event> out;
  for (SampledTile& tile : tiles) {
    auto event = core.submit(std::move(tile), now_s);
    EXPECT_TRUE(event.ok() && event->has_value());
    if (event.ok() && event->has_value()) out.push_back(**event);
  }
  return out;
}

std::vector<points::ClusterKey> keys_of(const points::PointModel& model) {
  std::vector<points::ClusterKey> out;
  for (const auto& [key, cluster] : model.clusters()) out.push_back(key);
  std::sort(out.begin(), out.end());
  return out;
}

TEST(PackerCore, AFrameBecomesEventsOfEveryTile) {
  PackerCore core(packer_config(), kEpoch);
  const auto tiles = sampled_frame({1}, camera(), 64);
  const std::vector<Event> events = submit_all(core, tiles);
  ASSERT_EQ(events.size(), tiles.size());
  uint64_t samples = 0, told = 0, told_samples = 0;
  for (size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    EXPECT_EQ(e.is_told(), e.kept > 0 || e.frame_complete) << "who waits for points, or for the frame, hears of it";
    if (e.is_told()) EXPECT_EQ(e.sequence.value, ++told);
    if (e.is_told()) told_samples += e.samples + e.untold_samples;
    EXPECT_EQ(e.kind, Event::Kind::kPatch);
    EXPECT_EQ(e.tile, i);
    EXPECT_TRUE(geometry::contains(tiles[i].rect, e.rect));
    if (e.kept == 0) EXPECT_EQ(e.rect.width * e.rect.height, 1) << "nothing of it need be coded";
    EXPECT_EQ(e.camera, tiles[i].camera);
    EXPECT_EQ(e.epoch, kEpoch);
    EXPECT_EQ(e.viewer.value, 77u);
    EXPECT_EQ(e.request.value, 1001u);
    EXPECT_EQ(e.frame_complete, i + 1 == events.size());
    samples += e.samples;
    EXPECT_EQ(e.frame_samples, samples);
  }
  const auto covered = [](const SampledTile& t) {
    return static_cast<uint64_t>(
        std::count_if(t.image.depth.begin(), t.image.depth.end(), [](uint32_t d) { return d != 0; }));
  };
  uint64_t expected = 0;
  for (const auto& t : tiles) expected += covered(t);
  EXPECT_EQ(samples, expected);
  EXPECT_EQ(told_samples, expected);
  EXPECT_LT(told, tiles.size()) << "of this view some tiles hold nothing";
  EXPECT_GT(core.model().points(), samples * 99 / 100);
  EXPECT_EQ(core.model().points(), core.statistics().kept);
  EXPECT_EQ(core.statistics().frames_complete, 1u);
  EXPECT_EQ(core.sequence().value, told);
  EXPECT_EQ(core.statistics().tiles, tiles.size());
  EXPECT_EQ(core.statistics().tiles_untold, tiles.size() - told);
}

// All points of the model.
std::multiset<std::tuple<points::ClusterKey, uint16_t, uint16_t, uint16_t, uint16_t, uint32_t>> points_of(
    const points::PointModel& model) {
  std::multiset<std::tuple<points::ClusterKey, uint16_t, uint16_t, uint16_t, uint16_t, uint32_t>> out;
  for (const auto& [key, cluster] : model.clusters())
    for (const points::Mosaic& m : cluster->mosaics) {
      const auto l = m.level(0);
      for (uint32_t i = 0; i < l.count; ++i) out.insert({key, l.x[i], l.y[i], l.z[i], l.normal[i], l.colour[i]});
    }
  return out;
}

TEST(PackerCore, WhatHasErrorsBecomesExact) {
  Config config = packer_config();
  config.model.compact = true;
  PackerCore exact(config, kEpoch), bounded(config, kEpoch);
  bounded.allow_errors({1.0 / 16, 1, 2});
  test::Replica replica(config.model);
  submit_all(exact, sampled_frame({1}, camera(), 64), 1);
  const auto events = submit_all(bounded, sampled_frame({1}, camera(), 64), 1);
  size_t refinable = 0, bytes = 0, exact_bytes = 0;
  for (const Event& e : events) {
    replica.apply(e);
    refinable += e.refinable;
    EXPECT_EQ(e.refinable, e.kept > 0);
    EXPECT_EQ(e.bounds.exact(), e.kept == 0);
    bytes += e.blob->size();
  }
  for (const Event& e : exact.events_since({0})) exact_bytes += e.blob->size();
  EXPECT_LT(bytes, exact_bytes * 8 / 10);
  EXPECT_EQ(bounded.model().points(), exact.model().points());
  EXPECT_FALSE(points_of(bounded.model()) == points_of(exact.model()));

  EXPECT_FALSE(bounded.refine(2)) << "nobody has drawn it since";
  size_t refined = 0;
  Sequence before;
  while (const auto event = bounded.refine(0)) {
    EXPECT_EQ(event->kind, Event::Kind::kRefine);
    if (before.value > 0) EXPECT_LT(event->refines, before) << "the newest first";
    before = event->refines;
    replica.apply(*event);
    ++refined;
  }
  EXPECT_EQ(refined, refinable);
  EXPECT_EQ(bounded.statistics().patches_refined, refined);
  EXPECT_EQ(replica.model().digest(), bounded.model().digest());
  const auto got = points_of(bounded.model()), wanted = points_of(exact.model());
  std::vector<decltype(got)::value_type> others;
  std::set_difference(got.begin(), got.end(), wanted.begin(), wanted.end(), std::back_inserter(others));
  EXPECT_LT(others.size(), wanted.size() / 50);
  const auto at_a_side = [](uint16_t q) { return q == 0 || q == 65535; };
  for (const auto& [key, x, y, z, normal, colour] : others)
    EXPECT_TRUE(at_a_side(x) || at_a_side(y) || at_a_side(z)) << "beyond the side it would be in another leaf";

  test::Replica late(config.model);
  late.catch_up(bounded);
  EXPECT_EQ(late.model().digest(), bounded.model().digest());
}

TEST(PackerCore, WhatWasForgottenInPartStaysAsItCame) {
  PackerCore core(packer_config(), kEpoch);
  core.allow_errors({1.0 / 16, 1, 2});
  submit_all(core, sampled_frame({1}, camera(), 320), 1);
  core.forget(std::vector{keys_of(core.model()).front()});
  EXPECT_FALSE(core.refine(0)) << "one tile brought it all";
}

TEST(PackerCore, DuplicateTilesAreDroppedAndCounted) {
  PackerCore core(packer_config(), kEpoch);
  const auto tiles = sampled_frame({1}, camera(), 128);
  ASSERT_TRUE(core.submit(tiles[0], 0).ok());
  const uint64_t digest = core.model().digest();
  auto again = core.submit(tiles[0], 0);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->has_value());
  EXPECT_EQ(core.statistics().tiles_duplicate, 1u);
  EXPECT_EQ(core.model().digest(), digest);
  // The same after the frame was finished.
  for (size_t i = 1; i < tiles.size(); ++i) ASSERT_TRUE(core.submit(tiles[i], 0).ok());
  const Sequence before = core.sequence();
  for (const auto& tile : tiles) EXPECT_FALSE(core.submit(tile, 0)->has_value());
  EXPECT_EQ(core.statistics().tiles_duplicate, 1 + tiles.size());
  EXPECT_EQ(core.sequence(), before);
}

TEST(PackerCore, AFrameThatEndsEarlySaysWhatItLeavesOut) {
  PackerCore core(packer_config(), kEpoch);
  auto tiles = sampled_frame({1}, camera(), 64);
  ASSERT_GT(tiles.size(), 4u);
  auto coarse = sampled_frame({9}, geometry::subsample(camera(), 4), 320);
  for (auto& t : coarse) t.step = 4;
  submit_all(core, coarse);
  submit_all(core, {tiles[0], tiles[2]});
  FramePart label = tiles[0];
  label.rect = {}, label.tile = 0;
  const uint64_t digest = core.model().digest();
  const auto end = core.end_frame(label, 0);
  ASSERT_TRUE(end.ok() && end->has_value());
  EXPECT_TRUE((*end)->frame_complete);
  EXPECT_EQ((*end)->left_out, tiles.size() - 2);
  EXPECT_EQ((*end)->tile, 1u) << "the first that is left out";
  EXPECT_EQ((*end)->tiles_in_frame, tiles.size());
  EXPECT_EQ((*end)->samples, 0u);
  EXPECT_EQ((*end)->request, tiles[0].request);
  EXPECT_EQ(core.model().digest(), digest) << "what came of it stays";
  EXPECT_TRUE(core.forget_superseded().empty()) << "the coarse pass shows what is left out";
  EXPECT_FALSE(core.end_frame(label, 0)->has_value()) << "once";
  EXPECT_FALSE(core.submit(tiles[3], 0)->has_value()) << "what comes late is dropped";

  // A view without any tile, one that is complete, and one of another epoch.
  tiles = sampled_frame({2}, camera(), 64);
  const auto none = core.end_frame(
      [&] {
        FramePart part = tiles[0];
        part.tiles_in_frame = 7;
        return part;
      }(),
      0);
  ASSERT_TRUE(none.ok() && none->has_value());
  EXPECT_EQ((*none)->left_out, 7u);
  tiles = sampled_frame({3}, camera(), 160);
  submit_all(core, tiles);
  EXPECT_FALSE(core.end_frame(tiles[0], 0)->has_value());
  label.epoch = {99}, label.frame = {4};
  EXPECT_FALSE(core.end_frame(label, 0)->has_value());
}

TEST(PackerCore, TilesOfOtherEpochsAreDroppedAndCounted) {
  PackerCore core(packer_config(), kEpoch);
  for (const uint64_t epoch : {2, 4})
    EXPECT_FALSE(core.submit(sampled_frame({1}, camera(), 320, {epoch})[0], 0)->has_value());
  EXPECT_EQ(core.statistics().tiles_other_epoch, 2u);
  EXPECT_EQ(core.sequence().value, 0u);
  EXPECT_EQ(core.model().points(), 0u);
}

TEST(PackerCore, FramesOfAnotherMasterAreNewOnes) {
  PackerCore core(packer_config(), kEpoch);
  const auto tile = sampled_frame({1}, camera(), 320)[0];
  ASSERT_TRUE(core.submit(tile, 0)->has_value());
  EXPECT_TRUE(core.has({1}, 0));
  core.forget_frames();
  EXPECT_FALSE(core.has({1}, 0));
  const auto again = core.submit(tile, 0);
  ASSERT_TRUE(again.ok() && again->has_value());
  EXPECT_TRUE((*again)->frame_complete);
  EXPECT_LT((*again)->kept, (*again)->samples / 10) << "the points are still there";
}

TEST(PackerCore, PublishesBeforeItsOwnModelHasThePoints) {
  PackerCore core(packer_config(), kEpoch);
  uint64_t told = 0;
  const auto tile = sampled_frame({1}, camera(), 320)[0];
  const auto event = core.submit(tile, 0, {}, [&](const Event& e) {
    told = e.kept;
    EXPECT_EQ(e.sequence, core.sequence());
    EXPECT_EQ(core.model().points(), 0u);
  });
  ASSERT_TRUE(event.ok() && event->has_value());
  EXPECT_GT(told, 0u);
  EXPECT_EQ(core.model().points(), told);
  const auto nothing = [](const Event&) { ADD_FAILURE() << "there is nothing to publish"; };
  EXPECT_FALSE(core.submit(tile, 0, {}, nothing)->has_value());
}

TEST(PackerCore, ContradictingTilesAreRefusedWithAReason) {
  PackerCore core(packer_config(), kEpoch);
  const auto good = sampled_frame({1}, camera(), 128);
  ASSERT_TRUE(core.submit(good[0], 0).ok());
  int refused = 0;
  const auto refuse = [&](const char* reason, auto&& change) {
    SampledTile tile = good[1];
    change(tile);
    const auto result = core.submit(tile, 0);
    ASSERT_FALSE(result.ok()) << reason;
    EXPECT_NE(result.error().text.find(reason), std::string::npos) << result.error().text;
    ++refused;
  };
  refuse("not finite", [](SampledTile& t) { t.camera.left = NAN; });
  refuse("no tile", [](SampledTile& t) { t.tile = t.tiles_in_frame; });
  refuse("no tile", [](SampledTile& t) { t.tiles_in_frame = kMaxTilesInFrame + 1; });
  refuse("no tile", [](SampledTile& t) { t.tile = t.tiles_in_frame = 0; });
  refuse("do not lie", [](SampledTile& t) { t.rect.x = -1; });
  refuse("do not lie", [](SampledTile& t) { t.rect.x = t.camera.width - t.rect.width + 1; });
  refuse("do not lie", [](SampledTile& t) { t.rect.x = INT32_MAX; });
  refuse("do not lie", [](SampledTile& t) { t.rect.height = 0; });
  refuse("its image has", [](SampledTile& t) { t.rect.width -= 1; });
  refuse("its image has", [](SampledTile& t) { t.image.normal.pop_back(); });
  refuse("earlier ones said", [](SampledTile& t) { t.tiles_in_frame += 1; });
  refuse("another camera", [](SampledTile& t) { t.camera.pose.position_room.x += 1e-9; });
  EXPECT_EQ(core.statistics().tiles_refused, static_cast<uint64_t>(refused));
  EXPECT_EQ(core.sequence().value, 1u);
  EXPECT_TRUE(core.submit(good[1], 0)->has_value()) << "a refused tile may come again, whole";
}

TEST(PackerCore, TheSameViewAgainIsRedundant) {
  PackerCore core(packer_config(), kEpoch);
  const uint64_t first = submit_all(core, sampled_frame({1}, camera(), 64)).back().frame_kept;
  for (uint64_t frame = 2; frame <= 4; ++frame) {
    const std::vector<Event> events = submit_all(core, sampled_frame({frame}, camera(), 64));
    const Event& last = events.back();
    EXPECT_EQ(last.frame_samples, first);
    EXPECT_LT(static_cast<double>(last.frame_kept), 0.01 * static_cast<double>(last.frame_samples))
        << "frame " << frame;
  }
}

TEST(PackerCore, FramesUnderWayTogetherSeeEachOthersPoints) {
  PackerCore core(packer_config(), kEpoch);
  auto a = sampled_frame({1}, camera(), 64), b = sampled_frame({2}, camera(), 64);
  uint64_t kept = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_TRUE(core.submit(a[i], 0)->has_value());
    kept += (*core.submit(b[i], 0))->kept;
  }
  EXPECT_LT(static_cast<double>(kept), 0.01 * static_cast<double>(core.statistics().kept));
}

TEST(PackerCore, KeepModeKeepsEverything) {
  Config config = packer_config();
  config.redundancy = Redundancy::kKeep;
  PackerCore core(config, kEpoch);
  for (uint64_t frame = 1; frame <= 2; ++frame) {
    const Event last = submit_all(core, sampled_frame({frame}, camera(), 128)).back();
    EXPECT_EQ(last.frame_kept, last.frame_samples);
    EXPECT_GT(last.frame_kept, 0u);
  }
}

TEST(PackerCore, WhatWasForgottenIsSampledAgain) {
  Config config = packer_config();
  config.obsolete_after_s = 5;
  PackerCore core(config, kEpoch);
  auto tiles = sampled_frame({1}, camera(), 64);
  const auto again = sampled_frame({2}, camera(), 64);
  const uint64_t samples = submit_all(core, tiles, 0).back().frame_kept;
  // Half of the next frame comes, then all is forgotten in mid-frame; its second half must not count as redundant.
  for (size_t i = 0; i < again.size() / 2; ++i) ASSERT_TRUE(core.submit(again[i], 1)->has_value());
  EXPECT_FALSE(core.tick(10).empty());
  EXPECT_EQ(core.model().points(), 0u);
  uint64_t kept = 0;
  for (size_t i = again.size() / 2; i < again.size(); ++i) kept += (*core.submit(again[i], 10))->kept;
  EXPECT_GT(kept, samples / 4);
}

TEST(PackerCore, EmptyTilesAreEventsWithoutPoints) {
  PackerCore core(packer_config(), kEpoch);
  SampledTile tile = sampled_frame({1}, camera(), 320)[0];
  tile.image = image::DepthImage(tile.rect.width, tile.rect.height);
  const auto event = core.submit(tile, 0);
  ASSERT_TRUE(event.ok() && event->has_value());
  EXPECT_TRUE((*event)->frame_complete);
  EXPECT_EQ((*event)->samples, 0u);
  const auto decoded = codec::decode(*(*event)->blob);
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(*decoded, image::DepthImage(1, 1));
  EXPECT_TRUE(core.events_since({0}).empty()) << "nothing to replay";
}

TEST(PackerCore, ClustersNobodyDrawsBecomeObsolete) {
  Config config = packer_config();
  config.obsolete_after_s = 5;
  PackerCore core(config, kEpoch);
  submit_all(core, sampled_frame({1}, camera(), 64), 100);
  EXPECT_TRUE(core.tick(104.9).empty());
  const std::vector<points::ClusterKey> all = keys_of(core.model());
  const std::vector<points::ClusterKey> drawn(all.begin(), all.begin() + static_cast<ptrdiff_t>(all.size() / 3));
  core.accessed(drawn, 103);
  core.accessed(std::vector<points::ClusterKey>{0x3fffffff}, 103);  // no such cluster
  core.accessed({}, 105.5);                                         // a viewer reports
  const std::vector<Event> events = core.tick(105.5);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kForget);
  EXPECT_EQ(events[0].sequence, core.sequence());
  EXPECT_EQ(events[0].clusters.size(), all.size() - drawn.size());
  EXPECT_EQ(keys_of(core.model()), drawn);
  EXPECT_EQ(core.statistics().clusters_forgotten, all.size() - drawn.size());
  core.accessed({}, 108.1);
  EXPECT_EQ(core.tick(108.1).at(0).clusters, drawn);
  EXPECT_EQ(core.model().points(), 0u);
  EXPECT_TRUE(core.tick(1000).empty());
}

TEST(PackerCore, NothingBecomesObsoleteWhileNoReportComes) {
  Config config = packer_config();
  config.obsolete_after_s = 5;
  PackerCore core(config, kEpoch);
  submit_all(core, sampled_frame({1}, camera(), 64), 100);
  core.accessed(keys_of(core.model()), 103);
  EXPECT_TRUE(core.tick(150).empty()) << "viewers may draw all of it";
  EXPECT_FALSE(core.tick(103 + 5 + 61).empty()) << "viewers are gone";
}

TEST(PackerCore, ZeroMeansNeverObsolete) {
  PackerCore core(packer_config(), kEpoch);
  submit_all(core, sampled_frame({1}, camera(), 64), 0);
  EXPECT_TRUE(core.tick(1e9).empty());
}

TEST(PackerCore, TooManyPointsForgetsTheLeastRecentlyDrawn) {
  Config config = packer_config();
  config.max_points = 20000;
  PackerCore core(config, kEpoch);
  submit_all(core, sampled_frame({1}, camera(0), 64), 1);
  const std::vector<points::ClusterKey> old = keys_of(core.model());
  submit_all(core, sampled_frame({2}, camera(2), 64), 2);
  ASSERT_GT(core.model().points(), config.max_points);
  const std::vector<points::ClusterKey> favourites(old.begin(), old.begin() + 20);
  core.accessed(favourites, 3);
  const uint64_t before = core.model().points();
  const std::vector<Event> events = core.tick(3);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_LE(core.model().points(), config.max_points * 9 / 10);
  EXPECT_GT(core.model().points(), config.max_points * 8 / 10);
  EXPECT_EQ(core.statistics().points_forgotten, before - core.model().points());
  for (const points::ClusterKey key : favourites) EXPECT_NE(core.model().find(key), nullptr);
  EXPECT_TRUE(core.tick(3).empty());
}

TEST(PackerCore, TheLogIsBounded) {
  Config config = packer_config();
  config.max_log_bytes = 200000;
  PackerCore core(config, kEpoch), unbounded(packer_config(), kEpoch);
  bool forgot = false;
  for (uint64_t frame = 1; frame <= 12; ++frame) {
    const double turn = 0.5 * static_cast<double>(frame);
    submit_all(unbounded, sampled_frame({frame}, camera(turn), 64), turn);
    submit_all(core, sampled_frame({frame}, camera(turn), 64), turn);
    forgot |= !core.tick(turn).empty();
    EXPECT_LE(core.log_bytes(),
              config.max_log_bytes + 40 * core.statistics().clusters_forgotten + 40 * core.model().clusters().size());
    EXPECT_GT(core.model().points(), 0u) << "the newest patches stay";
  }
  EXPECT_TRUE(forgot);
  EXPECT_GT(unbounded.log_bytes(), 2 * config.max_log_bytes);
  test::Replica late(config.model);
  late.catch_up(core);
  EXPECT_EQ(late.model().digest(), core.model().digest());
}

TEST(PackerCore, LateJoinersGetOnlyWhatStillMatters) {
  Config config = packer_config();
  config.obsolete_after_s = 5;
  PackerCore core(config, kEpoch);
  test::Replica present(config.model);
  submit_all(core, sampled_frame({1}, camera(0), 64), 0);
  present.catch_up(core);
  // Three clusters that the second frame does not see are drawn again.
  PackerCore other(packer_config(), kEpoch);
  submit_all(other, sampled_frame({2}, camera(2), 64), 0);
  std::vector<points::ClusterKey> drawn;
  for (const points::ClusterKey key : keys_of(core.model()))
    if (drawn.size() < 3 && !other.model().find(key)) drawn.push_back(key);
  core.accessed(drawn, 4);
  core.accessed({}, 6);                // a viewer reports
  EXPECT_EQ(core.tick(6).size(), 1u);  // most of it goes; a few patches keep points
  const auto second = submit_all(core, sampled_frame({2}, camera(2), 64), 6);
  core.accessed({}, 9.5);
  EXPECT_EQ(core.tick(9.5).at(0).clusters, drawn);  // now these go, too

  test::Replica late(config.model);
  const std::vector<Event> events = core.events_since({0});
  size_t expected = 0;
  for (const Event& e : second) expected += e.kept > 0;
  EXPECT_EQ(events.size(), expected) << "neither the first frame nor any forget matters to a newcomer";
  late.catch_up(core);
  EXPECT_EQ(late.model().digest(), core.model().digest());
  present.catch_up(core);
  EXPECT_EQ(present.model().digest(), core.model().digest());
  EXPECT_TRUE(core.events_since(core.sequence()).empty());
}

TEST(PackerCore, AnEpochClearsEverything) {
  PackerCore core(packer_config(), kEpoch);
  test::Replica early(core.model().config()), late(core.model().config());
  submit_all(core, sampled_frame({1}, camera(), 64));
  early.catch_up(core);
  EXPECT_FALSE(core.begin_epoch(kEpoch).has_value());
  const auto event = core.begin_epoch({9});
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->kind, Event::Kind::kEpoch);
  EXPECT_EQ(event->epoch.value, 9u);
  EXPECT_EQ(event->sequence, core.sequence());
  EXPECT_EQ(core.model().points(), 0u);
  submit_all(core, sampled_frame({1}, camera(1), 64, {9}));  // frame 1 is a new one now
  EXPECT_EQ(core.events_since({0}).front().kind, Event::Kind::kEpoch);
  early.catch_up(core);
  late.catch_up(core);
  EXPECT_EQ(early.model().digest(), core.model().digest());
  EXPECT_EQ(late.model().digest(), core.model().digest());
}

TEST(PackerCore, UnfinishedFramesDoNotPileUp) {
  PackerCore core(packer_config(), kEpoch);
  const auto tile = sampled_frame({1}, camera(), 160)[0];
  for (uint64_t frame = 1; frame <= 80; ++frame) {
    SampledTile t = tile;
    t.frame = {frame};
    ASSERT_TRUE(core.submit(t, 0)->has_value());
  }
  SampledTile newest = tile, oldest = tile;
  newest.frame = {80};
  EXPECT_FALSE(core.submit(newest, 0)->has_value());
  // The oldest frame's tiles are forgotten; a tile that comes again is packed again, with hardly any new point.
  const auto again = core.submit(oldest, 0);
  ASSERT_TRUE(again->has_value());
  EXPECT_LT((*again)->kept * 100, (*again)->samples);
}

}  // namespace
}  // namespace telesplat::packer
