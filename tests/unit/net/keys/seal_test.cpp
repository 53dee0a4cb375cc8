#include "common/net/keys/seal.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <set>
#include <string>
#include <vector>

namespace telesplat::net {
namespace {

std::vector<std::byte> counting(size_t n) {
  std::vector<std::byte> out(n);
  for (size_t i = 0; i < n; ++i) out[i] = std::byte(i);
  return out;
}

// Of the reference implementation: hashlib.blake2b(bytes(range(n)), digest_size=16, key=bytes(range(32))).
TEST(Seal, IsTheKeyedHashThatOthersMakeToo) {
  SealKey key;
  for (size_t i = 0; i < key.size(); ++i) key[i] = std::byte(i);
  const auto hex = [&](size_t n) {
    std::string out;
    for (const std::byte b : mac(key, counting(n))) {
      char text[3];
      std::snprintf(text, sizeof text, "%02x", unsigned(b));
      out += text;
    }
    return out;
  };
  EXPECT_EQ(hex(0), "3daf97bce7888fd59773c66bf647459c");
  EXPECT_EQ(hex(3), "194701a386811588a35d83be1f36769c");
  EXPECT_EQ(hex(200), "8aa5152a0f33a31b72568b613ea3c92e");
}

TEST(Seal, DependsOnEveryBitOfKeyAndBytes) {
  const SealKey key = make_seal_key();
  const auto bytes = counting(40);
  const Seal sealed = mac(key, bytes);
  EXPECT_TRUE(same_seal(sealed, mac(key, bytes)));
  for (size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    auto other = bytes;
    other[bit / 8] ^= std::byte(1 << bit % 8);
    EXPECT_FALSE(same_seal(sealed, mac(key, other))) << bit;
  }
  for (size_t bit = 0; bit < key.size() * 8; ++bit) {
    SealKey other = key;
    other[bit / 8] ^= std::byte(1 << bit % 8);
    EXPECT_FALSE(same_seal(sealed, mac(other, bytes))) << bit;
  }
}

TEST(Seal, OfAPeerMustHaveItsLength) {
  const Seal sealed = mac(make_seal_key(), counting(9));
  std::vector<std::byte> sent(sealed.begin(), sealed.end());
  EXPECT_TRUE(same_seal(sealed, sent));
  sent.back() ^= std::byte(1);
  EXPECT_FALSE(same_seal(sealed, sent));
  sent.back() ^= std::byte(1);
  sent.push_back({});
  EXPECT_FALSE(same_seal(sealed, sent));
  EXPECT_FALSE(same_seal(sealed, std::span<const std::byte>()));
}

TEST(Seal, KeysAreRandomAndOfTheirLength) {
  std::set<SealKey> keys;
  for (int i = 0; i < 100; ++i) keys.insert(make_seal_key());
  EXPECT_EQ(keys.size(), 100u);
  const SealKey key = *keys.begin();
  EXPECT_EQ(seal_key_of(key), key);
  EXPECT_FALSE(seal_key_of(counting(31)));
  EXPECT_FALSE(seal_key_of({}));
}

}  // namespace
}  // namespace telesplat::net
