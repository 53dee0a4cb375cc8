// Surfels come back as they were coded, take few bytes, and damaged streams are refused or bounded.
#include "common/codec/surfel_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace telesplat::codec {
namespace {

// A wavy sheet through a leaf: about `side` x `side` surfels.
SurfelLeaf sheet(uint32_t key, int side) {
  std::map<uint32_t, LeafSurfel> by_place;
  for (int i = 0; i < side; ++i)
    for (int k = 0; k < side; ++k) {
      const int x = 255 * i / side, z = 255 * k / side;
      const auto y = static_cast<uint8_t>(128 + 40 * std::sin(x * 0.02) * std::cos(z * 0.03));
      const auto shade = static_cast<uint32_t>(100 + x / 4);
      const LeafSurfel s{uint8_t(x), y, uint8_t(z), uint16_t((127 + x / 16) | (127 + z / 16) << 8), shade * 0x10101};
      by_place[s.place()] = s;
    }
  SurfelLeaf leaf{key, key * 10, {}};
  for (const auto& [place, s] : by_place) leaf.surfels.push_back(s);
  return leaf;
}

TEST(SurfelCodec, LeavesComeBackUnchanged) {
  std::mt19937 random(1);
  for (int n = 0; n < 30; ++n) {
    std::vector<SurfelLeaf> leaves;
    for (uint32_t key = 0; key < random() % 5; ++key) {
      std::map<uint32_t, LeafSurfel> by_place;
      for (uint32_t i = 0; i <= random() % 200; ++i) {
        const LeafSurfel s{uint8_t(random()), uint8_t(random()), uint8_t(random()), uint16_t(random()),
                           uint32_t(random() & 0xffffff)};
        by_place[s.place()] = s;
      }
      leaves.push_back({uint32_t(random() & 0x3fffffff), uint32_t(random() & 0xffffff), {}});
      for (const auto& [place, s] : by_place) leaves.back().surfels.push_back(s);
    }
    const auto decoded = decode_surfels(encode_surfels(leaves));
    ASSERT_TRUE(decoded.ok());
    EXPECT_EQ(*decoded, leaves);
  }
}

TEST(SurfelCodec, ASmoothSurfaceTakesLessThanFiveBytes) {
  std::vector<SurfelLeaf> leaves;
  size_t surfels = 0;
  for (uint32_t key = 0; key < 20; ++key) leaves.push_back(sheet(key, 16)), surfels += leaves.back().surfels.size();
  EXPECT_LT(encode_surfels(leaves).size(), 5 * surfels);
}

TEST(SurfelCodec, DamagedStreamsAreRefusedOrBounded) {
  const auto good = encode_surfels(std::vector{sheet(3, 12), sheet(4, 12)});
  std::mt19937 random(2);
  size_t refused = 0;
  for (int n = 0; n < 200; ++n) {
    auto bad = good;
    bad[random() % bad.size()] ^= uint8_t(1 + random() % 255);
    if (n % 4 == 0) bad.resize(random() % bad.size());
    const auto decoded = decode_surfels(bad);
    if (!decoded) {
      ++refused;
      continue;
    }
    size_t surfels = 0;
    for (const auto& leaf : *decoded) surfels += leaf.surfels.size();
    EXPECT_LE(surfels, kMaxCodedSurfels);
  }
  EXPECT_GT(refused, 0u);
}

TEST(SurfelCodec, TooManyLeavesAreRefused) { EXPECT_FALSE(decode_surfels(std::vector<uint8_t>(64, 0xff)).ok()); }

}  // namespace
}  // namespace telesplat::codec
