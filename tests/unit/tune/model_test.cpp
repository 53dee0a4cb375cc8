// The model of `telesplat tune`: exact where costs are known, monotone where it must be.
#include "tools/telesplat/tune/model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/telesplat/tune/candidates.h"

namespace telesplat::launcher {
namespace {

// A machine of four cores whose display costs nothing; round numbers.
TuneCosts costs() {
  TuneCosts c;
  c.cores = 4;
  c.steered = false;
  c.display_width = 1000, c.display_height = 1000, c.display_pixels = 1e6;
  c.sample_s = 1e-7, c.encode_s = 1e-8, c.tile_s = 1e-4, c.connect_s = 1e-5;
  c.pack = {1e-4, 1e-9};
  c.decode_s = 1e-9;
  c.patch_bytes = {100, 2};
  c.kept = 0.5;
  return c;
}
TuneSettings settings() { return {.samplers = 1, .tile_px = 250, .scale = 1, .octree_depth = 5, .update_rate_hz = 1}; }

TEST(TuneModel, IsExactOnKnownCosts) {
  const auto p = predict(costs(), settings());
  // 16 tiles of 62500 rays; 4 threads.
  const double tile_s = 1e-4 + 62500 * (1e-7 / 4 + 1e-8);
  EXPECT_DOUBLE_EQ(p.rays, 1e6);
  EXPECT_NEAR(p.sampling_s, 16 * tile_s, 1e-12);
  EXPECT_NEAR(p.packing_s, 16e-4 + 1e-3, 1e-12);
  EXPECT_NEAR(p.decoding_s, 5e5 * 1e-9, 1e-12);
  EXPECT_NEAR(p.connections_s, 1e-5 * (3 + 2), 1e-15);
  // The longest step whole, of the others a sixteenth, for tiles follow each other.
  const double chain_s = p.sampling_s + (p.packing_s + p.decoding_s) / 16;
  EXPECT_NEAR(p.latency_s, p.connections_s + chain_s + p.queue_s, 1e-12);
  // An update a second: nothing is busy, so that this is the interval.
  EXPECT_NEAR(p.updates_per_s, 1, 1e-12);
  EXPECT_NEAR(p.age_s, p.latency_s + 1, 1e-12);
  EXPECT_NEAR(p.queue_s, p.bottleneck_s * p.bottleneck_s / (2 * (1 - p.bottleneck_s)), 1e-12);
  EXPECT_NEAR(p.quality_db, 0, 1e-12) << "at the display's resolution, and nothing becomes new";
}

TEST(TuneModel, MoreSamplersHelpUntilTheCoresAreFullAndThenCost) {
  const auto latency = [](int samplers) {
    auto s = settings();
    s.samplers = samplers;
    return predict(costs(), s).latency_s;
  };
  EXPECT_LT(latency(2), latency(1));
  EXPECT_LT(latency(4), latency(2));
  EXPECT_GT(latency(8), latency(4));
  EXPECT_GT(latency(16), latency(8));
}

TEST(TuneModel, ConnectionsGrowWithSamplersTimesPartners) {
  TuneCosts c;
  c.data_servers = 1;
  const double few = connections(c, 8) - connections(c, 4);
  c.data_servers = 5;
  const double many = connections(c, 8) - connections(c, 4);
  EXPECT_DOUBLE_EQ(few, 4 * 3);
  EXPECT_DOUBLE_EQ(many, 4 * 7);
  // Both sides together, as in T5.4: four times the connections for twice as many, but for those to master and packer.
  const auto both = [&](int n) {
    c.data_servers = n;
    return connections(c, n) - 2.0 * n - 2.0 * c.viewers;
  };
  EXPECT_DOUBLE_EQ(both(16), 4 * both(8));
}

TEST(TuneModel, LinksCostARoundTripAndTheirRate) {
  const auto free_way = predict(costs(), settings());
  auto c = costs();
  c.viewer = way_of({.rtt_s = 0.05, .rate_bit_s = 8e6});
  const auto p = predict(c, settings());
  EXPECT_NEAR(p.patches_way_s, (16 * 100 + 5e5 * 2) * 1e-6, 1e-12);
  EXPECT_GT(p.latency_s, free_way.latency_s + 0.05);
  EXPECT_LE(p.updates_per_s, 1 / p.patches_way_s + 1e-9) << "no more than the link carries";
  const Way stalled = way_of({.rate_bit_s = 8e6, .stall_s = 1, .stall_every_s = 2});
  EXPECT_NEAR(stalled.byte_s, 2e-6, 1e-15);
  EXPECT_NEAR(stalled.rtt_s, 0.25, 1e-15);
}

TEST(TuneModel, ACostMakesNothingFaster) {
  const auto worse = [](auto change) {
    auto c = costs();
    c.steered = true, c.checked = 0.03, c.novelty_hz = 0.5, c.plan = {1e-3, 1e-9};
    c.viewer = {0.01, 1e-8}, c.select_s = 1e-3, c.draw_s = 5e-3, c.frame_s = 6e-3;
    auto s = settings();
    s.update_rate_hz = 20;
    const auto before = predict(c, s);
    change(c);
    const auto after = predict(c, s);
    EXPECT_GE(after.latency_s, before.latency_s);
    EXPECT_LE(after.updates_per_s, before.updates_per_s + 1e-9);
    EXPECT_LE(after.quality_db, before.quality_db + 1e-9);
  };
  worse([](TuneCosts& c) { c.sample_s *= 10; });
  worse([](TuneCosts& c) { c.encode_s *= 10; });
  worse([](TuneCosts& c) { c.tile_s *= 10; });
  worse([](TuneCosts& c) { c.connect_s *= 100; });
  worse([](TuneCosts& c) { c.plan.slope *= 50; });
  worse([](TuneCosts& c) { c.pack.slope *= 100; });
  worse([](TuneCosts& c) { c.decode_s *= 100; });
  worse([](TuneCosts& c) { c.patch_bytes.slope *= 10; });
  worse([](TuneCosts& c) { c.viewer.byte_s *= 10; });
  worse([](TuneCosts& c) { c.viewer.rtt_s *= 10; });
  worse([](TuneCosts& c) { c.sampler.rtt_s += 0.1; });
  worse([](TuneCosts& c) { c.others = 0.9; });
  worse([](TuneCosts& c) { c.novelty_hz *= 2; });
}

TEST(TuneModel, FinerSamplingCostsTimeAndGainsQuality) {
  double latency_s = 0, quality_db = -100;
  for (const double scale : {0.25, 0.4, 0.5, 0.7, 0.85, 1.0}) {
    auto s = settings();
    s.scale = scale;
    const auto p = predict(costs(), s);
    EXPECT_GT(p.latency_s, latency_s) << scale;
    EXPECT_GT(p.quality_db, quality_db) << scale;
    latency_s = p.latency_s, quality_db = p.quality_db;
  }
}

TEST(TuneModel, RaysOfASteeredViewGrowWithTheTimeBetweenUpdatesUpToAll) {
  auto c = costs();
  c.steered = true, c.checked = 0.1, c.novelty_hz = 0.5;
  auto s = settings();
  EXPECT_NEAR(predict(c, s).rays, 0.6e6, 1);
  c.tile_share = 0.5;
  EXPECT_NEAR(predict(c, s).packing_s, 8 * c.pack.fixed + 0.6e6 * c.pack.slope, 1e-12) << "of 16 tiles";
  s.update_rate_hz = 10;
  EXPECT_NEAR(predict(c, s).rays, 0.15e6, 1);
  s.update_rate_hz = 0.1;
  EXPECT_NEAR(predict(c, s).rays, 1e6, 1);
}

TEST(TuneModel, ADisplayTakesCoresFromSamplers) {
  auto c = costs();
  const double before = predict(c, settings()).latency_s;
  c.draw_s = 3 / 60.0, c.frame_s = 1 / 60.0;  // three cores
  EXPECT_NEAR(free_cores(c, settings()), 1, 1e-9);
  EXPECT_GT(predict(c, settings()).latency_s, before);
}

TEST(TuneModel, VolumesHaveNoTilesAndNoDepth) {
  auto c = costs();
  c.slices = true, c.voxels = 1e7, c.slice_pixels = 1e5;
  auto s = settings();
  const auto one = predict(c, s);
  s.tile_px = 64, s.octree_depth = 7;
  EXPECT_EQ(predict(c, s).latency_s, one.latency_s);
  s.samplers = 4;
  EXPECT_LT(predict(c, s).latency_s, one.latency_s);
}

TEST(TuneCandidates, ASlowLinkPrefersCoarserSampling) {
  auto c = costs();
  auto d = settings();
  d.scale = 0.85, d.adaptive = false;
  TuneGrid grid{{1}, {250}, {0.5, 0.7, 0.85, 1.0}, false, {5}, {1}};
  const auto latency_of = [&](double scale) {
    auto s = d;
    s.scale = scale;
    return predict(c, s).latency_s;
  };
  const double gain_local = score(latency_of(0.5), 0, latency_of(1), 0);
  c.viewer = {0.05, 1e-6};
  const double gain_slow = score(latency_of(0.5), 0, latency_of(1), 0);
  EXPECT_GT(gain_slow, gain_local);
}

TEST(TuneCandidates, NoneIsPredictedWorseThanTheDefaults) {
  auto c = costs();
  c.steered = true, c.checked = 0.03, c.novelty_hz = 0.3, c.viewer = {0.02, 1e-7};
  auto d = settings();
  d.scale = 0.7, d.update_rate_hz = 20;
  const auto base = predict(c, d);
  const auto found = propose(c, d, grid_around(d, 4, 64), 3);
  ASSERT_GE(found.size(), 1u);
  EXPECT_LE(found.size(), 3u);
  for (const auto& candidate : found) {
    EXPECT_NE(candidate.settings, d);
    EXPECT_LE(candidate.predicted.latency_s, base.latency_s * 1.0101);
    EXPECT_LE(candidate.predicted.age_s, base.age_s * 1.0101);
    EXPECT_GE(candidate.predicted.quality_db, base.quality_db - 0.1001);
  }
  for (size_t i = 0; i < found.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      EXPECT_TRUE(std::abs(found[i].predicted.latency_s - found[k].predicted.latency_s) >
                      0.01 * found[k].predicted.latency_s ||
                  std::abs(found[i].predicted.quality_db - found[k].predicted.quality_db) > 0.1)
          << "two that runs could not tell apart";
  EXPECT_GT(found[0].score, 0);
  EXPECT_TRUE(propose(c, d, {{1}, {250}, {}, true, {5}, {20}}, 3).empty()) << "nothing is free";
}

TEST(TuneCandidates, WhereNothingIsBetterNearOnesAreProposedForACheck) {
  auto c = costs();
  c.cores = 1, c.viewer = {0, 1e-8};
  auto d = settings();
  const TuneGrid grid{{1}, {250}, {0.4, 0.95, 1}, false, {5}, {1}};
  const auto found = propose(c, d, grid, 3);
  const auto base = predict(c, d);
  for (const auto& candidate : found) {
    EXPECT_LE(candidate.predicted.latency_s, 1.2 * base.latency_s);
    EXPECT_GE(candidate.predicted.quality_db, base.quality_db - 1);
  }
  ASSERT_EQ(found.size(), 1u) << "0.4 is too coarse, 1 is the default";
  EXPECT_EQ(found[0].settings.scale, 0.95);
}

TEST(TuneCandidates, OneGridValueIsNotTuned) {
  const auto d = settings();
  const TuneGrid grid{{1, 2}, {250}, {}, true, {5}, {1}};
  const auto all = settings_of(grid, d);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0], d);
  EXPECT_EQ(all[1].samplers, 2);
  EXPECT_EQ(differences(all[0], all[1]), 1);
}

}  // namespace
}  // namespace telesplat::launcher
