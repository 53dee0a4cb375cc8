// Codes of residuals: any residual comes back with any expectation, and no bits take more than the limit.
#include "common/codec/golomb.h"

#include <gtest/gtest.h>

#include <random>

namespace telesplat::codec {
namespace {

using detail::GolombContext;

constexpr int kMost = (1 << 24) - 1;

TEST(Golomb, AnyResidualComesBackWhateverWasExpected) {
  std::mt19937 random(4);
  for (int size = 0; size <= 24; ++size) {
    std::vector<int> residuals{0, -1, 1, kMost, -kMost, kMost, kMost, -kMost, 0, 0};
    for (int i = 0; i < 1000; ++i) residuals.push_back(static_cast<int>(random() >> (8 + random() % 24)) - (1 << 12));
    detail::BitWriter writer;
    writer.start(residuals.size() * GolombContext::kMostBits);
    GolombContext put, get;
    put.start(1u << size), get.start(1u << size);
    for (const int r : residuals) put.put(r, writer.sink);
    detail::BitReader reader;
    reader.start(writer.bytes(), GolombContext::kMostBits);
    for (const int r : residuals) ASSERT_EQ(get.get(reader.source), r) << size;
    EXPECT_TRUE(reader.finished());
  }
}

// A residual as large as expected takes as many bits as that, and few more.
TEST(Golomb, WhatIsExpectedIsShort) {
  for (int size = 1; size <= 24; ++size) {
    detail::BitWriter writer;
    writer.start(GolombContext::kMostBits);
    GolombContext context;
    context.start(1u << size);
    context.put((1 << size) - 1, writer.sink);
    EXPECT_LE(8 * writer.bytes().size(), size_t(size) + 12) << size;
  }
}

TEST(Golomb, NoBitsTakeMoreThanIsPromised) {
  std::mt19937 random(5);
  std::vector<uint8_t> ones(1 << 12, 0xff), noise(1 << 12);
  for (uint8_t& b : noise) b = static_cast<uint8_t>(random() | random());
  for (const auto& bytes : {ones, noise})
    for (int size = 0; size <= 24; ++size) {
      detail::BitReader reader;
      reader.start(bytes, GolombContext::kMostBits);
      GolombContext context;
      context.start(1u << size);
      while (!reader.overrun()) {
        const size_t before = reader.source.position;
        const int residual = context.get(reader.source);
        ASSERT_LE(reader.source.position - before, size_t{GolombContext::kMostBits}) << size;
        ASSERT_LT(std::abs(residual), 1 << 25);
      }
    }
}

}  // namespace
}  // namespace telesplat::codec
