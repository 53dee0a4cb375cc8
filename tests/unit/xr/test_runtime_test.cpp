// The test runtime's settings and its refreshes.
#include <gtest/gtest.h>

#include "tests/support/xr/config.h"
#include "tests/support/xr/pacing.h"

namespace telesplat::xr_test {
namespace {

TEST(Pacing, AnApplicationThatKeepsUpGetsEveryRefresh) {
  Pacing pacing(100, 5);
  double now_s = 5;
  for (int i = 1; i <= 50; ++i) {
    const auto frame = pacing.next(now_s);
    EXPECT_NEAR(frame.display_s, 5 + 0.01 * i, 1e-6) << i;
    EXPECT_NEAR(frame.wake_s, std::max(now_s, frame.display_s - 0.01), 1e-9);
    now_s = frame.wake_s + 0.008;
    EXPECT_EQ(pacing.shown_s(frame.display_s, now_s), frame.display_s);
  }
}

TEST(Pacing, WhoIsLateMissesRefreshes) {
  Pacing pacing(100, 0);
  const auto first = pacing.next(0);
  const double done_s = first.wake_s + 0.025;
  EXPECT_NEAR(pacing.shown_s(first.display_s, done_s), 0.03, 1e-9);
  EXPECT_NEAR(pacing.next(done_s).display_s, 0.03, 1e-9) << "what is nearly now cannot be made any more";
  EXPECT_NEAR(pacing.next(0.0301).display_s, 0.04, 1e-9);
}

TEST(Config, IsReadFromText) {
  const auto c =
      parse_config("rate=90;size=640x480;trajectory=still;lost=1.5;hidden=2-3;recentre=1:0.1,0,-2;fails=xrEndFrame@4");
  ASSERT_TRUE(c) << c.error().text;
  EXPECT_EQ(c->rate_hz, 90);
  EXPECT_EQ(c->width, 640);
  EXPECT_EQ(c->lost_s, 1.5);
  EXPECT_EQ(c->hidden_s->second, 3);
  EXPECT_EQ(c->recentre_by_m, glm::dvec3(0.1, 0, -2));
  EXPECT_EQ(c->fails, "xrEndFrame");
  EXPECT_EQ(c->fails_s, 4);
  EXPECT_TRUE(parse_config(""));
}

TEST(Config, RefusesWhatCannotBe) {
  for (const char* text : {"rate=0", "rate=x", "size=640", "colour=red", "lost", "hidden=3-2", "recentre=1:1,2",
                           "fails=xrEndFrame", "trajectory=/nowhere.csv"})
    EXPECT_FALSE(parse_config(text)) << text;
}

}  // namespace
}  // namespace telesplat::xr_test
