// Masks by their edges: any mask comes back, surfaces take few bytes, other bytes are refused or are some mask.
#include "common/codec/mask_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/masks.h"

namespace telesplat::codec::detail {
namespace {

std::vector<uint8_t> put(const Mask& mask) {
  std::vector<uint8_t> out;
  put_edges(out, mask);
  return out;
}

void expect_round_trip(const Mask& mask) {
  std::vector<uint8_t> bytes = put(mask);
  const size_t size = bytes.size();
  bytes.push_back(0xA5);  // what follows is left
  Reader in(bytes);
  Mask back(mask.width(), mask.height());
  ASSERT_TRUE(get_edges(in, back));
  ASSERT_TRUE(back == mask) << mask.width() << " x " << mask.height() << ", " << mask.count() << " pixels";
  ASSERT_EQ(in.left(), bytes.size() - size);
}

// Discs that overlap, with a hole.
Mask discs(int size) {
  Mask out(size, size);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const double a = std::hypot(x - size * 0.4, y - size * 0.45), b = std::hypot(x - size * 0.8, y - size * 0.7);
      if ((a < size * 0.35 && a > size * 0.1) || b < size * 0.15) out.set(x, y);
    }
  return out;
}

TEST(MaskEdges, AnyMaskComesBack) {
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    const int width = 1 + static_cast<int>(random() % 300), height = 1 + static_cast<int>(random() % 300);
    for (const double share : {0.0, 0.002, 0.2, 0.6, 1.0})
      expect_round_trip(test::random_mask(width, height, share, static_cast<uint32_t>(round)));
    expect_round_trip(test::band_mask(width, height, 1 + round % 5));
    expect_round_trip(discs(width));
  }
  expect_round_trip(test::random_mask(65536, 1, 0.3, 1));
  expect_round_trip(test::random_mask(1, 65536, 0.3, 1));
}

TEST(MaskEdges, SurfacesTakeLessThanTwoThirdsOfWhatPixelsTake) {
  const Mask mask = discs(256);
  std::vector<uint8_t> pixels;
  put_mask(pixels, mask);
  EXPECT_LT(3 * put(mask).size(), 2 * pixels.size());
  EXPECT_LT(put(mask).size(), 300u);
}

TEST(MaskEdges, OtherBytesAreRefusedOrSomeMask) {
  std::mt19937 random(6);
  size_t refused = 0, accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    const int width = 1 + static_cast<int>(random() % 260), height = 1 + static_cast<int>(random() % 260);
    auto bytes = put(round % 2 ? discs(std::min(width, height))
                               : test::random_mask(width, height, 0.05, static_cast<uint32_t>(round)));
    if (round % 5 == 0)
      bytes.resize(random() % (bytes.size() + 1));
    else
      for (uint32_t n = 1 + random() % 3; n > 0; --n) bytes[random() % bytes.size()] ^= 1u << random() % 8;
    Reader in(bytes);
    Mask back(width, height);
    const bool good = get_edges(in, back);
    (good ? accepted : refused) += 1;
    for (int y = 0; y < height; ++y)  // nothing beyond the last column
      if (width % 64 != 0) {
        ASSERT_EQ(back.row(y)[back.words_per_row() - 1] >> width % 64, 0u);
      }
    if (good) expect_round_trip(back);
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(accepted, 5u);
}

}  // namespace
}  // namespace telesplat::codec::detail
