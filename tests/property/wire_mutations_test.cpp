// Damaged messages: decoding gives a message or an error, and an accepted message is within its limits: its texts are
// UTF-8, and it survives another round trip.
#include <gtest/gtest.h>

#include <random>

#include "common/core/utf8.h"
#include "tests/support/wire_samples.h"

namespace telesplat::wire {
namespace {

using namespace telesplat::test;

TEST(WireMutations, EndInAMessageOrAnError) {
  std::mt19937 random(7);
  size_t accepted = 0, refused = 0;
  for (const MessageSample& sample : message_samples()) {
    const std::string& original = sample.body;
    for (int round = 0; round < 2000; ++round) {
      std::string body = original;
      for (int changes = 1 + int(random() % 4); changes > 0 && !body.empty(); --changes) {
        const size_t at = random() % body.size();
        switch (random() % 5) {
          case 0:
            body[at] = char(random());
            break;
          case 1:
            body[at] = char(body[at] ^ (1 << random() % 8));
            break;
          case 2:
            body.erase(at, 1 + random() % 8);
            break;
          case 3:
            body.insert(at, 1 + random() % 8, char(0xc0 + random() % 64));
            break;  // bytes of msgpack's types
          case 4:
            body.insert(at, original.substr(random() % original.size(), random() % 32));
            break;
        }
      }
      const auto encoded = sample.round_trip(bytes_of(body));
      ++(encoded ? accepted : refused);
      if (!encoded) {
        ASSERT_FALSE(encoded.error().text.empty());
        continue;
      }
      value_end(*encoded, 0, [&](std::string_view text) { EXPECT_TRUE(valid_utf8(text)) << sample.name; });
      const auto again = sample.round_trip(bytes_of(*encoded));
      ASSERT_TRUE(again) << sample.name << ": " << again.error().text;
    }
  }
  EXPECT_GT(accepted, 1000u);  // a changed value may be valid
  EXPECT_GT(refused, 10000u);
}

TEST(WireMutations, RandomBytesAreRefused) {
  std::mt19937 random(8);
  for (int round = 0; round < 20000; ++round) {
    std::string body(random() % 200, '\0');
    for (char& c : body) c = char(random());
    EXPECT_FALSE(decode<Hello>(bytes_of(body)));
    EXPECT_FALSE(decode<DepthTile>(bytes_of(body)));
  }
}

}  // namespace
}  // namespace telesplat::wire
