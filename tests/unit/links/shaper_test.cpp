#include "tools/wan_relay/way.h"

#include <gtest/gtest.h>

namespace telesplat::wan_relay {
namespace {

using links::Link;

TEST(Shaper, DelayAloneIsHalfARoundTrip) {
  Shaper s({.rtt_s = 0.04}, 0, 1);
  EXPECT_DOUBLE_EQ(s.pass(1, 1000), 1.02);
  EXPECT_DOUBLE_EQ(s.pass(1.5, 1 << 20), 1.52);
}

TEST(Shaper, BytesPassOneAfterTheOtherThenAreDelayed) {
  Shaper s({.rtt_s = 0.02, .rate_bit_s = 8e6}, 0, 1);  // a byte a microsecond
  EXPECT_NEAR(s.pass(0, 1000), 0.011, 1e-9);
  EXPECT_NEAR(s.pass(0, 1000), 0.012, 1e-9);
  EXPECT_NEAR(s.pass(0.5, 1000), 0.511, 1e-9);  // the link was idle
}

TEST(Shaper, QueueIsBoundedAndEmptiesAtTheRate) {
  Shaper s({.rate_bit_s = 8e6}, 0, 1);  // 100 ms: 100,000 bytes
  EXPECT_EQ(s.room(0), 100000u);
  for (int i = 0; i < 100; ++i) s.pass(0, 1000);
  EXPECT_EQ(s.room(0), 0u);
  EXPECT_EQ(s.queued(0), 100000u);
  EXPECT_NEAR(s.room_at_s(), 0.001, 1e-9);
  EXPECT_EQ(s.room(0.0105), 10000u);
  EXPECT_EQ(s.room(0.2), 100000u);
}

TEST(Shaper, NothingPassesWhileItStalls) {
  Shaper s({.rate_bit_s = 8e6, .stall_s = 2, .stall_every_s = 30}, 100, 1);
  EXPECT_NEAR(s.pass(100.5, 1000), 100.501, 1e-6);  // the first stall is a period away
  EXPECT_NEAR(s.pass(129.9995, 1000), 132.0005, 1e-6) << "half before the stall, half behind it";
  EXPECT_NEAR(s.pass(161, 1000), 162.001, 1e-6);
  EXPECT_NEAR(s.pass(163, 1000), 163.001, 1e-6);
}

TEST(Shaper, AnEndKeepsItsPlace) {
  Shaper s({.rtt_s = 0.02, .rate_bit_s = 8e6}, 0, 1);
  const double out = s.pass(0, 50000);
  EXPECT_GE(s.pass(0, 0), out);
  EXPECT_EQ(s.queued(0), 50000u);
}

TEST(Shaper, PiecesTakeAboutAMillisecond) {
  EXPECT_EQ(Shaper({.rate_bit_s = 2e7}, 0, 1).piece(), 2500u);
  EXPECT_EQ(Shaper({.rate_bit_s = 1e8}, 0, 1).piece(), 12500u);
  EXPECT_EQ(Shaper({.rate_bit_s = 1e4}, 0, 1).piece(), 512u);
  EXPECT_EQ(Shaper({}, 0, 1).piece(), 65536u);
}

}  // namespace
}  // namespace telesplat::wan_relay
