// A data server's volume: levels, statistics, placement, classification, gradients, parts, series.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_access.hpp>
#include <limits>
#include <random>

#include "common/image/normal.h"
#include "services/data/volume/slices.h"
#include "tests/support/volume/samples.h"

namespace telesplat::data {
namespace {

void rescale(Volume& v, double scale, double offset) {
  const double a = v.lo * scale + offset, b = v.hi * scale + offset;
  v.scale = scale, v.offset = offset, v.lo = std::min(a, b), v.hi = std::max(a, b);
}

TEST(VolumeLevels, KeepTheValuesOfSmallTypesAndSpans) {
  Volume u8 = noise();
  EXPECT_EQ(*choose_levels(u8, 3, 200), (volume::Levels{0, 1, 256}));
  rescale(u8, -0.5, 10);
  const auto turned = *choose_levels(u8, u8.lo, u8.hi);
  EXPECT_EQ(turned, (volume::Levels{10 - 127.5, 0.5, 256}));
  const auto i8 = make_volume<int8_t>({2, 1, 1}, VoxelType::kI8, [](int i, int, int) { return i ? 127 : -128; });
  EXPECT_EQ(*choose_levels(i8, -128, 127), (volume::Levels{-128, 1, 256}));
  EXPECT_EQ(to_levels(i8, *choose_levels(i8, -128, 127), 0, 1).narrow, (std::vector<uint8_t>{0, 255}));

  auto ct = make_volume<int16_t>({3, 1, 1}, VoxelType::kI16, [](int i, int, int) {
    return i == 0 ? -1024 : i == 1 ? 7 : 3071;
  });
  const auto levels = *choose_levels(ct, ct.lo, ct.hi);
  EXPECT_EQ(levels, (volume::Levels{-1024, 1, 4096}));
  EXPECT_EQ(to_levels(ct, levels, 0, 1).wide, (std::vector<uint16_t>{0, 1031, 4095}));
  auto wide = make_volume<uint16_t>({3, 1, 1}, VoxelType::kU16, [](int i, int, int) { return i * 32767; });
  EXPECT_EQ(choose_levels(wide, wide.lo, wide.hi)->count, 4096);
  EXPECT_EQ(to_levels(wide, *choose_levels(wide, wide.lo, wide.hi), 0, 1).wide.back(), 4095);
  const auto few = make_volume<uint16_t>({3, 1, 1}, VoxelType::kU16, [](int i, int, int) { return 500 + i; });
  EXPECT_EQ(*choose_levels(few, few.lo, few.hi), (volume::Levels{500, 1, 3}));
  EXPECT_EQ(to_levels(few, *choose_levels(few, few.lo, few.hi), 0, 1).narrow, (std::vector<uint8_t>{0, 1, 2}));
}

TEST(VolumeLevels, FloatsAreEvenlySpacedAndWhatIsNotFiniteIsTheSmallest) {
  const float values[] = {-2, 3, NAN, INFINITY, -INFINITY, 0.5};
  const auto v = make_volume<float>({6, 1, 1}, VoxelType::kF32, [&](int i, int, int) { return values[i]; });
  const auto levels = *choose_levels(v, v.lo, v.hi);
  EXPECT_EQ(levels.count, 4096);
  EXPECT_EQ(levels.value(0), -2);
  EXPECT_NEAR(levels.value(4095), 3, 1e-12);
  const auto wide = to_levels(v, levels, 0, 1).wide;
  EXPECT_EQ(wide, (std::vector<uint16_t>{0, 4095, 0, 0, 0, 2048}));
  EXPECT_EQ(choose_levels(v, 5, 5)->count, 1);
  EXPECT_FALSE(choose_levels(v, -1e31, 0));
  Volume unscaled = v;
  unscaled.scale = 0;
  EXPECT_FALSE(choose_levels(unscaled, 0, 1));
}

TEST(VolumeStatistics, TypicalValuesLeaveTheBackgroundOut) {
  // 90 % air with noise at 0 to 5, the rest evenly from 50 to 149, and one hot voxel.
  std::vector<uint64_t> counts(256);
  for (int l = 0; l <= 5; ++l) counts[size_t(l)] = 150000 - 1000 * uint64_t(l);
  for (int l = 50; l < 150; ++l) counts[size_t(l)] = 1000;
  counts[255] = 1;
  const auto range = describe_values(counts, {0, 1, 256}, 0, 255, false);
  EXPECT_EQ(range.lo, 0);
  EXPECT_EQ(range.hi, 255);
  EXPECT_NEAR(range.typical_lo, 51, 1);
  EXPECT_NEAR(range.typical_hi, 149, 1);
  // Nearly all values are within 4 % of the range: only the most frequent one is background.
  std::vector<uint64_t> narrow(1000);
  narrow[0] = 1000000, narrow[1] = 5000, narrow[2] = 5000, narrow[999] = 1;
  const auto close = describe_values(narrow, {0, 1, 1000}, 0, 999, true);
  EXPECT_EQ(close.typical_lo, 1);
  EXPECT_EQ(close.typical_hi, 2);
  EXPECT_TRUE(close.hounsfield);
  const auto constant = describe_values({77}, {5, 1, 1}, 5, 5, false);
  EXPECT_EQ(constant.typical_lo, 5);
  EXPECT_EQ(constant.typical_hi, 5);
}

TEST(VolumePlacement, CentresTurnsAndScales) {
  Volume v = make_volume<uint8_t>({10, 20, 5}, VoxelType::kU8, [](int i, int, int) { return i; });
  v.index_to_data = {{1, 0, 0, 0}, {0, 0.5, 0, 0}, {0, 0, 8, 0}, {100, -30, 7, 1}};  // 10 x 10 x 40
  const auto store = open_or_fail(v, {}, {.room_size_m = 0.8});
  const auto& grid = store->session().grid;
  const auto box = grid.box_room();
  EXPECT_NEAR(box.size().x, 0.2, 1e-6);
  EXPECT_NEAR(box.size().y, 0.8, 1e-6) << "z is up";
  EXPECT_NEAR(box.size().z, 0.2, 1e-6);
  EXPECT_LT(glm::length(box.lo + box.hi), 1e-6f);
  EXPECT_GT((grid.index_to_room * glm::dvec4(0, 0, 4, 1)).y, (grid.index_to_room * glm::dvec4(0, 0, 3, 1)).y);
  const auto lying = open_or_fail(v, {}, {.room_size_m = 2, .up = "y"});
  EXPECT_NEAR(lying->session().grid.box_room().size().z, 2, 1e-6);
}

TEST(VolumeStore, GivesAllVoxelsOfTheShownLevelsInOrder) {
  const Volume v = noise();
  const auto store = open_or_fail(v);
  const auto shown = levels_between(100, 180);
  const auto got = voxels_or_fail(*store, 2, 9, shown);
  EXPECT_EQ(got.k_begin, 2);
  EXPECT_EQ(got.k_end, 9);
  ASSERT_EQ(got.rows.size(), 7u * 11 + 1);
  size_t n = 0;
  for (int k = 2; k < 9; ++k)
    for (int j = 0; j < 11; ++j) {
      ASSERT_EQ(got.rows[size_t(k - 2) * 11 + size_t(j)], n);
      for (int i = 0; i < 19; ++i) {
        const int level = std::to_integer<int>(v.stored[size_t((k * 11 + j) * 19 + i)]);
        if (level < 100 || level >= 180) continue;
        ASSERT_LT(n, got.size());
        ASSERT_EQ(got.i[n], i);
        ASSERT_EQ(got.level[n], level);
        ++n;
      }
    }
  EXPECT_EQ(n, got.size());
  EXPECT_EQ(got.rows.back(), n);
  EXPECT_EQ(got.normal.size(), n);
  const auto weights = *store->slice_weights(0, shown);
  ASSERT_EQ(weights.size(), 13u);
  for (int k = 2; k < 9; ++k)
    EXPECT_EQ(weights[size_t(k)], got.rows[size_t(k - 1) * 11] - got.rows[size_t(k - 2) * 11]);
  EXPECT_EQ(voxels_or_fail(*store, 0, 13, {}).size(), 0u);
  EXPECT_EQ(voxels_or_fail(*open_or_fail(v, {.lit = false}), 2, 9, shown).normal.size(), 0u);
  EXPECT_FALSE(store->voxels(1, 0, 13, shown, {}));
  EXPECT_FALSE(store->voxels(-1, 0, 13, shown, {}));
}

TEST(VolumeStore, WhatIsAddedMakesTheWholeWithWhatThereIs) {
  const auto store = open_or_fail(noise());
  const auto had = levels_between(90, 140), shown = levels_between(60, 200);
  const auto old = voxels_or_fail(*store, 0, 13, had), added = voxels_or_fail(*store, 0, 13, shown, had);
  EXPECT_GT(added.size(), 0u);
  EXPECT_EQ(volume::merge(old, added), voxels_or_fail(*store, 0, 13, shown));
  EXPECT_EQ(voxels_or_fail(*store, 0, 13, had, shown).size(), 0u) << "all of it is there";
}

TEST(VolumeStore, PartsAddUpToTheWhole) {
  const Volume v = noise();
  const auto shown = levels_between(30, 200);
  const auto whole = voxels_or_fail(*open_or_fail(v), 0, 13, shown);
  for (const int parts : {1, 2, 3, 13}) {
    volume::Voxels joined;
    joined.rows = {0};
    size_t weight = 0;
    for (int part = 0; part < parts; ++part) {
      const auto store = open_or_fail(v, {.part = std::to_string(part) + "/" + std::to_string(parts)});
      EXPECT_EQ(store->session().part, part);
      EXPECT_EQ(store->session().parts, parts);
      const auto p = voxels_or_fail(*store, 0, 13, shown);
      EXPECT_EQ(p.k_begin, 13 * part / parts);
      EXPECT_EQ(p.k_end, 13 * (part + 1) / parts);
      const uint32_t before = uint32_t(joined.i.size());
      for (size_t r = 1; r < p.rows.size(); ++r) joined.rows.push_back(before + p.rows[r]);
      joined.i.insert(joined.i.end(), p.i.begin(), p.i.end());
      joined.level.insert(joined.level.end(), p.level.begin(), p.level.end());
      joined.normal.insert(joined.normal.end(), p.normal.begin(), p.normal.end());
      const auto weights = *store->slice_weights(0, shown);
      EXPECT_EQ(weights.size(), size_t(p.k_end - p.k_begin));
      for (const uint32_t w : weights) weight += w;
    }
    joined.k_end = 13;
    EXPECT_EQ(joined, whole) << parts << " parts";
    EXPECT_EQ(weight, whole.size());
  }
  for (const char* part : {"1", "1/", "/2", "2/2", "-1/2", "0/0", "0/14", "a/b", "0/2x", "99999999999/2"}) {
    std::vector<Volume> steps;
    steps.push_back(noise());
    const auto store = open_steps(std::move(steps), {.part = part});
    ASSERT_FALSE(store) << part;
    EXPECT_NE(store.error().text.find(part), std::string::npos) << store.error().text;
  }
}

// A ball, denser inside, in millimetres, on a grid of any axes: normals point away from its centre, in room space.
TEST(VolumeStore, NormalsOfABallPointOutward) {
  const glm::dmat4 placements[] = {
      glm::dmat4(1.0),
      {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 2.5, 0}, {3, 4, 5, 1}},
      {{0, 0.7, 0, 0}, {0, 0, 2, 0}, {1.2, 0, 0, 0}, {0, 0, 0, 1}},
      {{-1, 0, 0, 0}, {0, 1, 0.2, 0}, {0.3, 0, 1.4, 0}, {0, 9, 0, 1}},
  };
  for (const glm::dmat4& placement : placements)
    for (const std::string up : {"auto", "y", "-x"}) {
      const glm::dvec3 centre = placement * glm::dvec4(16, 15, 17, 1);
      const auto density = [&](int i, int j, int k) {
        return 4000 - 200 * glm::distance(glm::dvec3(placement * glm::dvec4(i, j, k, 1)), centre);
      };
      auto v = make_volume<float>({33, 31, 35}, VoxelType::kF32, density);
      v.index_to_data = placement;
      const auto store = open_or_fail(v, {}, {.up = up});
      const auto& grid = store->session().grid;
      const glm::dvec3 centre_room = grid.index_to_room * glm::dvec4(16, 15, 17, 1);
      const auto got = voxels_or_fail(*store, 0, 35, levels_between(0, 4096));
      ASSERT_EQ(got.size(), v.stored.size() / 4);
      for (size_t n = 0; n < got.size(); n += 7) {
        const glm::ivec3 index(n % 33, n / 33 % 31, n / 33 / 31);
        const glm::dvec3 from_centre = glm::dvec3(grid.index_to_room * glm::dvec4(index, 1)) - centre_room;
        if (glm::length(glm::dvec3(index) - glm::dvec3(16, 15, 17)) < 5) continue;  // differences are coarse there
        ASSERT_NE(got.normal[n], volume::kNoNormal);
        // Differences at the faces are one-sided.
        const bool face = index.x % 32 == 0 || index.y % 30 == 0 || index.z % 34 == 0;
        ASSERT_GT(glm::dot(glm::dvec3(image::decode_normal16(got.normal[n])), glm::normalize(from_centre)),
                  face ? 0.97 : 0.99)
            << index.x << " " << index.y << " " << index.z;
      }
    }
}

TEST(VolumeStore, FlatRegionsHaveNoNormals) {
  const auto step =
      make_volume<uint16_t>({16, 4, 4}, VoxelType::kU16, [](int i, int, int) { return i < 8 ? 100 : 1000; });
  const auto got = voxels_or_fail(*open_or_fail(step), 0, 4, levels_between(0, 4096));
  for (size_t n = 0; n < got.size(); ++n)
    ASSERT_EQ(got.normal[n] == volume::kNoNormal, got.i[n] != 7 && got.i[n] != 8) << got.i[n];
  const auto single = make_volume<uint8_t>({1, 1, 1}, VoxelType::kU8, [](int, int, int) { return 9; });
  EXPECT_EQ(voxels_or_fail(*open_or_fail(single), 0, 1, levels_between(0, 256)).normal, std::vector{volume::kNoNormal});
}

std::vector<Volume> series(int steps, int side = 8) {
  std::vector<Volume> out;
  for (int s = 0; s < steps; ++s)
    out.push_back(make_volume<uint16_t>({side, side, side}, VoxelType::kU16,
                                        [&](int i, int j, int k) { return 100 * s + i + j + k; }));
  return out;
}

TEST(VolumeSeries, ThatFitsIsReadOnceAndLevelsCoverAllOfIt) {
  std::atomic<size_t> reads = 0;
  const auto store = open_steps(series(13), {}, {}, &reads);
  ASSERT_TRUE(store) << store.error().text;
  const auto& session = (*store)->session();
  EXPECT_EQ(session.steps, 13);
  EXPECT_EQ(session.steps_per_s, 12.5);
  EXPECT_EQ(session.levels, (volume::Levels{0, 1, 1222}));
  for (int step = 0; step < 13; ++step) {
    const auto v = voxels_or_fail(**store, 0, 8, levels_between(0, 4096), {}, step);
    EXPECT_EQ(v.level.front(), 100 * step);
    EXPECT_EQ(v.level.back(), 100 * step + 21);
  }
  EXPECT_EQ(reads.load(), 13u);
  EXPECT_EQ((*open_steps(series(5), {.steps_per_s = 0}))->session().steps_per_s, 0);
  EXPECT_EQ((*open_steps(series(5)))->session().steps_per_s, 5);
  EXPECT_EQ((*open_steps(series(1), {.steps_per_s = 3}))->session().steps_per_s, 0);
}

TEST(VolumeSeries, ThatDoesNotFitIsReadAsItPlays) {
  std::atomic<size_t> reads = 0;
  const auto store = open_steps(series(5, 64), {.cache_mb = 1}, {}, &reads);  // half a MB a step
  ASSERT_TRUE(store) << store.error().text;
  EXPECT_EQ(reads.load(), 1u);
  for (int n = 0; n < 12; ++n) {
    const int step = n % 5;
    const auto v = voxels_or_fail(**store, 3, 4, levels_between(0, 4096), {}, step);
    ASSERT_EQ(v.size(), 64u * 64);
    // Values beyond the first step's count as its largest.
    EXPECT_EQ(v.level.front(), std::min(100 * step + 3, 189));
  }
}

TEST(VolumeSeries, StepsOfOtherSizesAreErrors) {
  auto steps = series(2);
  steps.push_back(noise());
  const auto store = open_steps(std::move(steps));
  ASSERT_FALSE(store);
  for (const char* part : {"test", "step 2", "19 x 11 x 13", "8 x 8 x 8"})
    EXPECT_NE(store.error().text.find(part), std::string::npos) << store.error().text;
}

TEST(VolumeStore, TellsOtherDataByTheirHash) {
  const auto one = open_or_fail(noise(1)), half = open_or_fail(noise(1), {.part = "1/2"}),
             other = open_or_fail(noise(2));
  EXPECT_EQ(one->content_hash(), half->content_hash());
  EXPECT_NE(one->content_hash(), other->content_hash());
}

TEST(VolumeStore, TakesAFittingPresetAndRefusesNonsense) {
  Volume ct =
      make_volume<int16_t>({9, 9, 9}, VoxelType::kI16, [](int i, int j, int k) { return i < 4 ? -1000 : 100 * j + k; });
  ct.hounsfield = true;
  const auto read = [&](size_t, const ReadProgress&) -> Result<Volume> { return ct; };
  const auto open = [&](const VolumeOptions& o) {
    return VolumeStore::make(read, 1, "head.mha", o, {}, [](const char*, double) {});
  };
  const auto store = open({});
  ASSERT_TRUE(store) << store.error().text;
  const auto& session = (*store)->session();
  EXPECT_TRUE(session.range.hounsfield);
  EXPECT_EQ(session.transfer, *volume::transfer_preset(volume::fitting_preset(session.range), session.range));
  EXPECT_EQ((*store)->format(), "test");
  EXPECT_FALSE(open({.transfer = "bones"}));
  ct.index_to_data[1] = ct.index_to_data[0];  // flat
  const auto flat = open({});
  ASSERT_FALSE(flat);
  EXPECT_NE(flat.error().text.find("head.mha"), std::string::npos) << flat.error().text;
}

}  // namespace
}  // namespace telesplat::data
