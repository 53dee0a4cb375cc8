// Masks of tiles in messages: any mask comes back, patterns that repeat cost little, other words are refused or give
// some mask.
#include <gtest/gtest.h>

#include <random>

#include "common/codec/mask_stream.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using image::PixelMask;

void expect_round_trip(const PixelMask& mask) {
  const auto words = encode_mask(mask);
  const auto back = decode_mask(words, mask.width(), mask.height());
  ASSERT_TRUE(back) << back.error().text;
  ASSERT_TRUE(*back == mask) << mask.width() << " x " << mask.height() << ", " << mask.count() << " pixels";
  ASSERT_EQ(encode_mask(mask), words) << "not deterministic";
}

// One pixel in 32, in a pattern that repeats after 64 pixels.
PixelMask pattern(int width, int height, int dx, int dy) {
  const PixelMask square = test::spread_mask(64, 64, 32, 9);
  PixelMask out(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (square.at((x + dx) % 64, (y + dy) % 64)) out.set(x, y);
  return out;
}

TEST(Masks, AnyComesBack) {
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    const int width = 1 + static_cast<int>(random() % 300), height = 1 + static_cast<int>(random() % 300);
    for (const double share : {0.0, 0.002, 1.0 / 32, 0.2, 0.6, 1.0})
      expect_round_trip(test::random_mask(width, height, share, static_cast<uint32_t>(round)));
    expect_round_trip(test::band_mask(width, height, 1 + round % 5));
    expect_round_trip(pattern(width, height, round, 3 * round));
    PixelMask both = pattern(width, height, round, 0);
    for (int y = height / 3; y < height / 2; ++y)
      for (int x = 0; x < width / 2; ++x) round % 2 ? both.set(x, y) : both.clear(x, y);
    both.set(width - 1, height - 1);
    expect_round_trip(both);
  }
  expect_round_trip(pattern(16384, 3, 1, 1));
  expect_round_trip(pattern(3, 16384, 1, 1));
}

TEST(Masks, PatternsThatRepeatCostATenth) {
  const PixelMask mask = pattern(256, 256, 0, 0), none = test::spread_mask(256, 256, 32, 3);
  EXPECT_LT(4 * encode_mask(mask).size(), 260u);
  EXPECT_GT(4 * encode_mask(none).size(), 1000u);
  // A pattern within an object: its outline adds to the bytes.
  PixelMask inside(256, 256), elsewhere(256, 256);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      if (std::hypot(x - 120, y - 140) > 90) continue;
      if (mask.at(x, y)) inside.set(x, y);
      if (none.at(x, y)) elsewhere.set(x, y);
    }
  EXPECT_LT(5 * encode_mask(inside).size(), 3 * encode_mask(elsewhere).size());
}

TEST(Masks, OtherWordsAreRefusedOrSomeMask) {
  std::mt19937 random(6);
  size_t refused = 0, accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    const int width = 1 + static_cast<int>(random() % 260), height = 1 + static_cast<int>(random() % 260);
    auto words = encode_mask(round % 2 ? pattern(width, height, round, 1)
                                       : test::random_mask(width, height, 0.05, static_cast<uint32_t>(round)));
    if (round % 5 == 0)
      words.resize(random() % (words.size() + 1));
    else
      for (uint32_t n = 1 + random() % 3; n > 0; --n) words[random() % words.size()] ^= 1u << random() % 32;
    const auto back = decode_mask(words, width, height);
    (back ? accepted : refused) += 1;
    if (!back) continue;
    ASSERT_EQ(back->width(), width);
    ASSERT_EQ(back->height(), height);
    for (int y = 0; y < height; ++y)  // no bits beyond the last column
      if (width % 64 != 0) {
        ASSERT_EQ(back->row(y)[back->words_per_row() - 1] >> width % 64, 0u);
      }
    ASSERT_TRUE(*decode_mask(encode_mask(*back), width, height) == *back);
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(accepted, 100u);
}

}  // namespace
}  // namespace telesplat::codec
