// The voxel codec: round trips of many shapes, hostile bytes, unions.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/volume/voxels.h"

namespace telesplat::volume {
namespace {

struct Shape {
  int x, y, k_begin, k_end;
  double density;
  int levels;
  bool lit, smooth;
};

Voxels make_voxels(const Shape& s, std::mt19937& random, int level_begin = 0) {
  std::uniform_real_distribution<double> unit(0, 1);
  Voxels v;
  v.k_begin = s.k_begin, v.k_end = s.k_end;
  v.rows.push_back(0);
  for (int k = s.k_begin; k < s.k_end; ++k)
    for (int j = 0; j < s.y; ++j) {
      for (int i = 0; i < s.x; ++i) {
        if (unit(random) >= s.density) continue;
        v.i.push_back(uint16_t(i));
        const int level = s.smooth ? (i * 3 + j * 5 + k * 7) : int(random());
        v.level.push_back(uint16_t(level_begin + (unsigned(level) % unsigned(s.levels - level_begin))));
        if (s.lit)
          v.normal.push_back(random() % 50 == 0 ? kNoNormal
                             : s.smooth         ? uint16_t((i % 255) | (j % 255) << 8)
                                                : uint16_t(random() % 255 | random() % 255 << 8));
      }
      v.rows.push_back(uint32_t(v.i.size()));
    }
  return v;
}

std::vector<Shape> shapes() {
  std::vector<Shape> out;
  for (const double density : {0.0, 0.003, 0.3, 0.9, 1.0})
    for (const int levels : {1, 256, 257, 4096})
      for (const bool lit : {false, true})
        for (const bool smooth : {false, true}) {
          out.push_back({33, 9, 4, 7, density, levels, lit, smooth});
          out.push_back({1, 5, 0, 3, density, levels, lit, smooth});
          out.push_back({300, 1, 0, 1, density, levels, lit, smooth});
        }
  out.push_back({4096, 40, 2, 4, 0.6, 4096, true, false});  // several groups
  out.push_back({128, 128, 0, 12, 0.7, 256, true, true});
  out.push_back({7, 7, 5, 5, 1, 256, true, true});  // no slices
  return out;
}

TEST(VolumeVoxels, ComeBackAsTheyWere) {
  std::mt19937 random(1);
  for (const Shape& s : shapes()) {
    const Voxels v = make_voxels(s, random);
    const auto bytes = encode_voxels(v, s.x, s.y);
    const auto again = decode_voxels(bytes, s.x, s.y, s.k_begin, s.k_end, s.levels);
    ASSERT_TRUE(again) << again.error().text;
    ASSERT_EQ(*again, v);
    // Asked for more slices than the bytes hold, the answer has those that it holds.
    const auto fewer = decode_voxels(bytes, s.x, s.y, std::max(0, s.k_begin - 1), s.k_end + 2, s.levels);
    ASSERT_TRUE(fewer) << fewer.error().text;
    ASSERT_EQ(*fewer, v);
  }
}

TEST(VolumeVoxels, SmoothDataTakeFewBytes) {
  std::mt19937 random(2);
  const Shape s{128, 128, 0, 12, 1.0, 256, true, true};
  const Voxels v = make_voxels(s, random);
  EXPECT_LT(double(encode_voxels(v, s.x, s.y).size()), 1.0 * double(v.size()));
}

// Voxels that the decoder accepts fulfil the promises of Voxels, for any bytes.
void expect_sound(const Voxels& v, const Shape& s) {
  ASSERT_GE(v.k_begin, s.k_begin);
  ASSERT_LE(v.k_end, s.k_end);
  ASSERT_EQ(v.rows.size(), size_t(v.k_end - v.k_begin) * size_t(s.y) + 1);
  ASSERT_EQ(v.rows.front(), 0u);
  ASSERT_EQ(v.rows.back(), v.size());
  ASSERT_EQ(v.level.size(), v.size());
  ASSERT_TRUE(v.normal.empty() || v.normal.size() == v.size());
  for (size_t r = 0; r + 1 < v.rows.size(); ++r) {
    ASSERT_LE(v.rows[r], v.rows[r + 1]);
    for (size_t n = v.rows[r]; n < v.rows[r + 1]; ++n) {
      ASSERT_LT(v.i[n], s.x);
      ASSERT_LT(v.level[n], s.levels);
      ASSERT_TRUE(n == v.rows[r] || v.i[n - 1] < v.i[n]);
    }
  }
}

TEST(VolumeVoxels, TruncationIsNoticedAtEveryLength) {
  std::mt19937 random(3);
  for (const Shape& s : {Shape{33, 9, 4, 7, 0.3, 4096, true, false}, Shape{33, 9, 4, 7, 1, 200, false, true}}) {
    auto bytes = encode_voxels(make_voxels(s, random), s.x, s.y);
    for (size_t length = 0; length < bytes.size(); ++length)
      ASSERT_FALSE(decode_voxels(std::span(bytes).first(length), s.x, s.y, s.k_begin, s.k_end, s.levels)) << length;
    bytes.push_back(0);
    ASSERT_FALSE(decode_voxels(bytes, s.x, s.y, s.k_begin, s.k_end, s.levels));
  }
}

TEST(VolumeVoxels, DamagedBytesGiveErrorsOrSoundVoxels) {
  std::mt19937 random(4);
  size_t refused = 0, taken = 0;
  for (const Shape& s : {Shape{33, 9, 4, 7, 0.3, 300, true, false}, Shape{20, 4, 0, 9, 0.9, 200, false, true},
                         Shape{500, 3, 0, 2, 0.05, 256, true, true}}) {
    const auto good = encode_voxels(make_voxels(s, random), s.x, s.y);
    for (int round = 0; round < 6000; ++round) {
      auto bytes = good;
      for (int n = 1 + int(random() % 3); n-- > 0;) bytes[random() % bytes.size()] = uint8_t(random());
      const auto v = decode_voxels(bytes, s.x, s.y, s.k_begin, s.k_end, s.levels);
      v ? ++taken : ++refused;
      if (!v) continue;
      ASSERT_NO_FATAL_FAILURE(expect_sound(*v, s));
    }
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(taken, 100u) << "the mutations should reach the samples";
}

TEST(VolumeVoxels, RefusesSlicesPlacesAndLevelsThatWereNotAskedFor) {
  std::mt19937 random(5);
  const Shape s{33, 9, 4, 7, 1.0, 300, true, true};
  const auto bytes = encode_voxels(make_voxels(s, random), s.x, s.y);
  EXPECT_TRUE(decode_voxels(bytes, 33, 9, 4, 7, 300));
  EXPECT_FALSE(decode_voxels(bytes, 33, 9, 5, 7, 300));
  EXPECT_FALSE(decode_voxels(bytes, 33, 9, 4, 6, 300));
  EXPECT_FALSE(decode_voxels(bytes, 32, 9, 4, 7, 300));
  EXPECT_FALSE(decode_voxels(bytes, 33, 8, 4, 7, 300));
  EXPECT_FALSE(decode_voxels(bytes, 33, 9, 4, 7, 150));
}

TEST(VolumeVoxels, ClaimsWithoutBytesCostLittle) {
  // A slice of 4096 x 4096 rows, all full by the claim of a constant block: more voxels than a coded set may have.
  const std::vector<uint8_t> claim{'V', 0, 0, 4, 4, 4, 1, 4, 0};
  const auto v = decode_voxels(claim, 4096, 4096, 0, 4, 256);
  ASSERT_FALSE(v);
  EXPECT_NE(v.error().text.find("damaged"), std::string::npos);
}

TEST(VolumeVoxels, MergingGivesTheWholeBack) {
  std::mt19937 random(6);
  for (const bool lit : {false, true})
    for (const double share : {0.0, 0.3, 1.0}) {
      const Shape s{33, 9, 4, 7, 0.6, 300, lit, false};
      const Voxels whole = make_voxels(s, random);
      Voxels parts[2];
      for (Voxels& p : parts) p.k_begin = whole.k_begin, p.k_end = whole.k_end, p.rows = {0};
      for (size_t r = 0; r + 1 < whole.rows.size(); ++r) {
        for (size_t n = whole.rows[r]; n < whole.rows[r + 1]; ++n) {
          Voxels& p = parts[double(random() % 1000) < 1000 * share];
          p.i.push_back(whole.i[n]), p.level.push_back(whole.level[n]);
          if (lit) p.normal.push_back(whole.normal[n]);
        }
        for (Voxels& p : parts) p.rows.push_back(uint32_t(p.i.size()));
      }
      EXPECT_EQ(merge(parts[0], parts[1]), whole);
      EXPECT_EQ(merge(parts[1], parts[0]), whole);
    }
}

TEST(VolumeLevelSet, AddsContainsAndTravels) {
  LevelSet a, b;
  EXPECT_TRUE(a.empty());
  for (int l = 0; l < kMaxLevels; l += 7) a.add(l);
  for (int l = 0; l < kMaxLevels; l += 14) b.add(l);
  for (int l = 0; l < kMaxLevels; ++l) ASSERT_EQ(a.has(l), l % 7 == 0);
  EXPECT_TRUE(a.contains(b));
  EXPECT_FALSE(b.contains(a));
  EXPECT_EQ(*LevelSet::from_bytes(a.bytes()), a);
  b.add(a);
  EXPECT_EQ(a, b);
  EXPECT_FALSE(LevelSet::from_bytes(a.bytes().first(100)));
}

}  // namespace
}  // namespace telesplat::volume
