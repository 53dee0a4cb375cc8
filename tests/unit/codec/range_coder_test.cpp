// Bits coded by their frequency: any bits come back, equal bits take few bytes, and added bytes are detected.
#include "common/codec/range_coder.h"

#include <gtest/gtest.h>

#include <random>

namespace telesplat::codec::detail {
namespace {

std::vector<uint8_t> put(const std::vector<uint32_t>& bits) {
  std::vector<uint8_t> out{7};  // earlier bytes stay
  RangeEncoder coder(out);
  AdaptiveBit models[3];
  for (size_t i = 0; i < bits.size(); ++i) {
    coder.put(bits[i], models[i % 3]);
    if (i % 5 == 0) coder.put_raw(static_cast<uint32_t>(i) & 1023, 10);
  }
  coder.finish();
  EXPECT_EQ(out[0], 7);
  out.erase(out.begin());
  return out;
}

// True if all numbers came back.
bool get(std::span<const uint8_t> bytes, const std::vector<uint32_t>& bits) {
  RangeDecoder coder(bytes);
  AdaptiveBit models[3];
  bool same = true;
  for (size_t i = 0; i < bits.size(); ++i) {
    same &= coder.get(models[i % 3]) == bits[i];
    if (i % 5 == 0) same &= coder.get_raw(10) == (i & 1023);
  }
  return same && coder.finished();
}

TEST(RangeCoder, AnyBitsComeBack) {
  std::mt19937 random(8);
  for (int round = 0; round < 2000; ++round) {
    std::vector<uint32_t> bits(random() % 300);
    const uint32_t share = random() % 65;
    for (uint32_t& bit : bits) bit = random() % 64 < share;
    auto bytes = put(bits);
    ASSERT_TRUE(get(bytes, bits)) << round;
    ASSERT_TRUE(bytes.empty() || bytes.back() != 0) << "zeros follow anyway";
    bytes.push_back(1);
    bytes.resize(bytes.size() + 4);
    ASSERT_FALSE(get(bytes, bits)) << "bytes that nobody reads";
  }
}

TEST(RangeCoder, WhatIsAlikeTakesNearlyNothing) {
  std::vector<uint8_t> out;
  RangeEncoder coder(out);
  AdaptiveBit model;
  for (int i = 0; i < 10000; ++i) coder.put(0, model);
  coder.finish();
  EXPECT_LT(out.size(), 8u);
}

// Carries with any bits: after one bit has its highest probability the other one comes.
TEST(RangeCoder, CarriesGoThroughAsManyBytesAsThereAre) {
  std::mt19937 random(9);
  for (int round = 0; round < 300; ++round) {
    std::vector<uint32_t> bits;
    while (bits.size() < 2000) bits.insert(bits.end(), random() % 400, random() & 1);
    ASSERT_TRUE(get(put(bits), bits)) << round;
  }
}

TEST(RangeCoder, AnySignedNumberComesBack) {
  std::mt19937 random(10);
  constexpr int kMost = (1 << SignedModel::kMostBits) - 1;
  std::vector<int> numbers{0, 1, -1, kMost, -kMost};
  for (int i = 0; i < 5000; ++i) numbers.push_back(static_cast<int>(random() % (2 * kMost + 1)) - kMost);
  for (int i = -300; i < 300; ++i) numbers.push_back(i);
  std::vector<uint8_t> out;
  RangeEncoder coder(out);
  SignedModel put_model, get_model;
  for (size_t i = 0; i < numbers.size(); ++i) put_model.code(BitCoder{coder}, numbers[i], i % 3);
  coder.finish();
  RangeDecoder decoder(out);
  for (size_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(get_model.code(BitDecoder{decoder}, 0, i % 3), numbers[i]) << i;
  EXPECT_TRUE(decoder.finished());
}

// Any bytes decode to numbers within the range.
TEST(RangeCoder, AnyBytesAreSignedNumbersWithinTheRange) {
  std::mt19937 random(11);
  for (int round = 0; round < 200; ++round) {
    std::vector<uint8_t> bytes(random() % 40);
    for (uint8_t& b : bytes) b = static_cast<uint8_t>(round % 3 == 0 ? 0xFF : random());
    RangeDecoder decoder(bytes);
    SignedModel model;
    for (size_t i = 0; i < 300; ++i)
      ASSERT_LT(std::abs(model.code(BitDecoder{decoder}, 0, i % 3)), 1 << SignedModel::kMostBits);
  }
}

}  // namespace
}  // namespace telesplat::codec::detail
