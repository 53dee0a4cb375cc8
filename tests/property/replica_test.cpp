// Replicated state: after any events, a viewer that applies the packer's events holds the packer's clusters, byte for
// byte.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/support/packer_scenes.h"

namespace telesplat {
namespace {

void expect_identical(const points::PointModel& a, const points::PointModel& b) {
  ASSERT_EQ(a.points(), b.points());
  ASSERT_EQ(a.digest(), b.digest());
  ASSERT_EQ(a.clusters().size(), b.clusters().size());
  for (const auto& [key, cluster] : a.clusters()) {
    const points::Cluster* other = b.find(key);
    ASSERT_NE(other, nullptr);
    ASSERT_EQ(cluster->leaf_room, other->leaf_room);
    ASSERT_EQ(cluster->mosaics.size(), other->mosaics.size());
    for (size_t i = 0; i < cluster->mosaics.size(); ++i) {
      const points::Mosaic &m = cluster->mosaics[i], &n = other->mosaics[i];
      ASSERT_EQ(m.sequence(), n.sequence());
      ASSERT_EQ(m.pixel_range(), n.pixel_range());
      ASSERT_EQ(m.cone_axis(), n.cone_axis());
      ASSERT_EQ(m.cone_cosine(), n.cone_cosine());
      ASSERT_EQ(m.centroid_room(cluster->leaf_room), n.centroid_room(cluster->leaf_room));
      for (int l = 0; l < points::kLevels; ++l) {
        const auto u = m.level(l), v = n.level(l);
        ASSERT_EQ(u.count, v.count);
        for (const auto& [p, q] : {std::pair(u.x, v.x), {u.y, v.y}, {u.z, v.z}, {u.normal, v.normal}})
          ASSERT_EQ(std::memcmp(p, q, u.count * sizeof *p), 0);
        ASSERT_EQ(std::memcmp(u.colour, v.colour, u.count * sizeof *u.colour), 0);
      }
    }
  }
}

class ReplicaCheck : public testing::TestWithParam<int> {};

TEST_P(ReplicaCheck, HoldsIdenticalClustersAfterRandomEvents) {
  std::mt19937_64 random(static_cast<uint64_t>(GetParam()));
  const auto chance = [&](double p) { return std::uniform_real_distribution<double>(0, 1)(random) < p; };
  packer::Config config = test::packer_config();
  config.model.depth = 4 + GetParam() % 3;
  config.obsolete_after_s = 8;
  config.max_points = GetParam() % 4 < 2 ? 60000 : 0;
  config.max_log_bytes = GetParam() % 3 ? 400000 : 0;
  const bool keep = GetParam() % 2 == 1;  // then single patches of clusters are forgotten
  config.model.compact = !keep;
  config.redundancy = keep ? packer::Redundancy::kKeep : packer::Redundancy::kEliminate;
  config.patches_per_cluster = GetParam() % 5 == 4 ? 0 : static_cast<uint32_t>(1 + GetParam() % 3);
  packer::PackerCore core(config, {1});

  // One replica hears everything, one misses some events and asks for them, one joins anew each time.
  test::Replica steady(config.model), gappy(config.model);
  uint64_t next_frame = 1, expected_sequence = 0;
  int patches = 0, forgets = 0, patch_forgets = 0, epochs = 0, gaps = 0, published = 0, refinements = 0;
  double now_s = 0;
  std::vector<packer::SampledTile> waiting;
  // One joins while events go on: it gets a few old ones at a time, and keeps new ones meanwhile.
  std::optional<test::Replica> joiner;
  packer::EventLog::Replay left;
  std::vector<packer::Event> kept;
  int joined = 0;
  const auto bring_up_to_date = [&] {
    if (!joiner) {
      if (!chance(0.05)) return;
      joiner.emplace(config.model);
      left = core.replay({0});
      kept.clear();
    }
    for (uint64_t n = random() % 4; n > 0; --n) {
      if (const auto event = core.next(left)) {
        ASSERT_LE(event->sequence, left.until);
        joiner->apply(*event);
        continue;
      }
      joiner->skip_to(left.until);
      for (const auto& event : kept) joiner->apply(event);
      ASSERT_EQ(joiner->model().digest(), core.model().digest()) << "one that joined in parts";
      ++joined;
      return joiner.reset();
    }
  };
  const auto publish = [&](const packer::Event& event) {
    if (joiner) kept.push_back(event);
    ASSERT_EQ(event.sequence.value, ++expected_sequence) << "sequences have no holes when published";
    ++published;
    patches += event.kind == packer::Event::Kind::kPatch;
    forgets += event.kind == packer::Event::Kind::kForget;
    patch_forgets += !event.frames.empty();
    epochs += event.kind == packer::Event::Kind::kEpoch;
    refinements += event.kind == packer::Event::Kind::kRefine;
    steady.apply(event);
    const bool lost = chance(0.15);
    if (lost) return;
    if (event.sequence != gappy.applied().next()) {
      ++gaps;
      gappy.catch_up(core);
    } else {
      gappy.apply(event);
    }
  };

  // At least 1000 events, and more until each kind has come.
  for (int step = 0; published < 1000 || forgets < 3 || epochs < 1 || gaps < 3; ++step) {
    ASSERT_LT(step, 50000);
    now_s += 0.2;
    if (chance(0.05)) core.allow_errors(chance(0.6) ? packer::AllowedErrors{1.0 / 8, 1, 2} : packer::AllowedErrors{});
    if (chance(0.01) && step > 20) {
      if (const auto event = core.begin_epoch({core.epoch().value + 1})) publish(*event);
    } else if (chance(0.15)) {
      for (uint64_t n = 1 + random() % 8; n > 0; --n)
        if (const auto event = core.refine(now_s - 10)) publish(*event);
    } else if (chance(0.2)) {
      std::vector<points::ClusterKey> seen;
      std::vector<uint32_t> frames;  // empty every other time
      const bool told = chance(0.5);
      for (const auto& [key, cluster] : core.model().clusters()) {
        if (!chance(0.3)) continue;
        seen.push_back(key);
        if (told) frames.push_back(cluster->mosaics[random() % cluster->mosaics.size()].frame_tag());
      }
      core.accessed(seen, now_s, frames);
      for (const auto& event : core.tick(now_s)) publish(event);
    } else {
      if (waiting.empty()) {
        // Some frames are coarse; those are forgotten first, perhaps before they are complete.
        const int width = chance(0.3) ? 40 : 160;
        waiting =
            test::sampled_frame({next_frame++}, test::scene_camera(test::random_eye(random), width, width * 5 / 8),
                                width == 40 ? 16 : 64, core.epoch());
        for (auto& t : waiting) t.step = width == 40 ? 4 : 1;
        // Others come from a head at rest; their points go when it has moved on.
        if (width == 160 && chance(0.4))
          for (auto& t : waiting) t.extra = true, t.missed.reset(t.rect.width, t.rect.height);
        std::shuffle(waiting.begin(), waiting.end(), random);
        if (chance(0.3)) waiting.push_back(waiting.front());  // a duplicate
      }
      auto event = core.submit(waiting.back(), now_s);
      waiting.pop_back();
      ASSERT_TRUE(event.ok()) << event.error().text;
      if (event->has_value() && (*event)->is_told()) publish(**event);
      for (const auto& forget : core.forget_superseded()) publish(forget);
    }
    bring_up_to_date();
    if (HasFatalFailure()) return;
    if (step % 100 == 0) {
      test::Replica late(config.model);
      late.catch_up(core);
      ASSERT_EQ(late.model().digest(), core.model().digest()) << "a late joiner at step " << step;
    }
  }
  EXPECT_GT(patches, 100);
  EXPECT_GT(joined, 2);
  EXPECT_GT(patch_forgets, 10);
  EXPECT_GT(refinements, 50);
  if (keep) {
    EXPECT_EQ(patch_forgets, forgets);
  }

  gappy.catch_up(core);
  test::Replica late(config.model);
  late.catch_up(core);
  expect_identical(core.model(), steady.model());
  expect_identical(core.model(), gappy.model());
  expect_identical(core.model(), late.model());
  // A replica that stopped at any event can go on from there.
  EXPECT_TRUE(core.events_since(core.sequence()).empty());
}

// Four seeds cover each depth, limit and way of forgetting.
INSTANTIATE_TEST_SUITE_P(Seeds, ReplicaCheck, testing::Range(1, 5));

// Replays from every sequence at which a replica may have stopped.
class ReplicaResume : public testing::TestWithParam<packer::Redundancy> {};
TEST_P(ReplicaResume, FromEverySequence) {
  std::mt19937_64 random(5);
  packer::Config config = test::packer_config();
  config.redundancy = GetParam();
  config.model.compact = GetParam() == packer::Redundancy::kEliminate;
  config.patches_per_cluster = 2;
  config.model.depth = 3;
  config.obsolete_after_s = 2;
  packer::PackerCore core(config, {1});
  std::vector<packer::Event> events;
  for (uint64_t frame = 1; frame <= 12; ++frame) {
    const double now_s = static_cast<double>(frame);
    for (auto& tile :
         test::sampled_frame({frame}, test::scene_camera(test::random_eye(random), 96, 64), 48, core.epoch()))
      if (const packer::Event event = **core.submit(std::move(tile), now_s); event.is_told()) events.push_back(event);
    std::vector<points::ClusterKey> seen;
    for (const auto& [key, cluster] : core.model().clusters())
      if (random() % 2) seen.push_back(key);
    core.accessed(seen, now_s);
    for (const auto& event : core.tick(now_s + 0.5)) events.push_back(event);
    if (frame == 3) events.push_back(*core.begin_epoch({2}));
  }
  for (size_t stop = 0; stop <= events.size(); ++stop) {
    test::Replica replica(config.model);
    for (size_t i = 0; i < stop; ++i) replica.apply(events[i]);
    replica.catch_up(core);
    ASSERT_EQ(replica.model().digest(), core.model().digest()) << "stopped after " << stop;
  }
}
INSTANTIATE_TEST_SUITE_P(Modes, ReplicaResume,
                         testing::Values(packer::Redundancy::kEliminate, packer::Redundancy::kKeep));

}  // namespace
}  // namespace telesplat
