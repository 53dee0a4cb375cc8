// For any order and times of epochs, parts and restarts: a displayed list belongs to one epoch, displayed epochs never
// go back, and a newer epoch is shown within the promised time once its points cover a view.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "client/viewer/points/epoch_switch.h"
#include "client/viewer/points/model_cache.h"
#include "tests/support/points_scenes.h"

namespace telesplat::viewer {
namespace {

constexpr double kPatience_s = 0.15;

class EpochsProperty : public testing::TestWithParam<uint32_t> {
 protected:
  void begin(EpochId epoch, Sequence sequence) {
    const bool held = cache.begin_replica(config, epoch, sequence);
    choice.begin(epoch, held, now_s);
  }

  const points::ModelConfig config = test::scene_config(4);
  const geometry::Camera camera = test::scene_camera({0, 0.3, 0.8}, 24, 16);
  const image::DepthImage image = test::sample_scene(camera, {0, 0, 24, 16});
  ModelCache cache;
  EpochSwitch choice{kPatience_s};
  double now_s = 0;
};

TEST_P(EpochsProperty, OneEpochAFrameNeverBackAndNeverStuck) {
  std::mt19937 random(GetParam());
  const auto chance = [&](int percent) { return int(random() % 100) < percent; };
  const int epoch_rate = 1 + int(random() % 15);  // per cent of the steps
  const bool coarse_pass = chance(70), restarts = chance(50);

  std::map<std::pair<uint64_t, uint64_t>, EpochId> epoch_of;  // (replica, sequence) -> epoch
  uint64_t sequence = 0, replica = 0, frame = 0, shown_epoch = 0, switches = 0;
  EpochId epoch{1};
  bool known = false;  // true once the newest replica's epoch is known
  // The promised time, computed apart from the class under test.
  double unshown_since_s = -1;
  bool covered = false, covered_by_own = false, any = false, coarse = false;
  const auto new_replica = [&] {
    ++replica;
    covered = covered_by_own = any = coarse = false;
  };

  begin({}, {});
  new_replica();
  splat::DrawList list;
  for (int step = 0; step < 400; ++step) {
    now_s += 0.001 * double(random() % 30);
    bool displaying = false;
    if (chance(50)) {  // events arrive while a frame is drawn
      cache.select(camera, {}, list);
      displaying = true;
    }
    if (restarts && chance(1)) {  // a new packer; the scene may have changed meanwhile
      if (chance(50)) ++epoch.value;
      sequence = 0;
      known = false;
      begin({}, {});
      new_replica();
    } else if (chance(epoch_rate)) {
      ++epoch.value;
      known = true;
      begin(epoch, {++sequence});
      new_replica();
      if (choice.waiting() && unshown_since_s < 0) unshown_since_s = now_s;
    } else if (chance(80)) {
      const uint64_t part_step = coarse_pass && chance(30) ? 4 : 1;
      const bool complete = chance(15), own = chance(70);
      cache.insert(points::prepare_patch(config, {++sequence}, camera, {0, 0, 24, 16}, image, {++frame}), epoch);
      epoch_of[{replica, sequence}] = epoch;
      if (!known && choice.waiting() && epoch.value != shown_epoch && unshown_since_s < 0) unshown_since_s = now_s;
      known = true;
      choice.on_part({epoch, part_step, complete, own}, now_s);
      any = true;
      coarse |= part_step > 1;
      covered |= complete;
      covered_by_own |= complete && part_step == 1 && own;
    } else if (!list.clusters_seen.empty()) {
      cache.forget({++sequence}, std::span(list.clusters_seen).first(1));
    }
    if (choice.due(now_s)) {
      cache.show_newest();
      choice.shown();
      ++switches;
    }
    cache.free_dropped();
    if (displaying) {
      uint64_t sum = 0;  // reads all drawn points: the address sanitizer sees if they are gone
      for (const auto& item : list.items) sum += item.cluster->key + item.level.x[item.level.count - 1];
      EXPECT_TRUE(list.items.empty() || sum > 0);
      cache.end_frame();
    }

    cache.select(camera, {}, list);
    for (const auto& item : list.items) {
      const auto of = epoch_of.find({list.replica, item.sequence.value});
      ASSERT_NE(of, epoch_of.end());
      ASSERT_EQ(of->second, list.epoch) << "step " << step;
    }
    if (list.points > 0) {
      ASSERT_GE(list.epoch.value, shown_epoch) << "step " << step;
      ASSERT_EQ(list.epoch, choice.displayed());
      if (list.epoch.value > shown_epoch) unshown_since_s = -1;
      shown_epoch = list.epoch.value;
    }
    if (covered_by_own) {
      ASSERT_EQ(list.replica, replica) << "step " << step;
    }
    if (unshown_since_s >= 0 && now_s >= unshown_since_s + kPatience_s && (covered || (any && !coarse))) {
      ASSERT_EQ(list.epoch, epoch) << "step " << step;
    }
    cache.end_frame();
  }
  cache.free_dropped();
  EXPECT_GT(shown_epoch, 1u);
  EXPECT_GT(switches, 0u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, EpochsProperty, testing::Range(1u, 51u));

}  // namespace
}  // namespace telesplat::viewer
