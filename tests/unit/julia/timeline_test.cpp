#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/julia/animation.h"

namespace telesplat::julia {
namespace {

TEST(JuliaTimeline, SwingsThereAndBackForEver) {
  const auto t = parse_timeline("c.y=-0.4:0.4:10s");
  ASSERT_TRUE(t.ok()) << t.error().text;
  ASSERT_EQ(t->tracks.size(), 1u);
  const Track& track = t->tracks.front();
  for (const auto& [time, value] :
       {std::pair{0.0, -0.4}, {5.0, 0.0}, {10.0, 0.4}, {15.0, 0.0}, {20.0, -0.4}, {50.0, 0.4}})
    EXPECT_NEAR(track.value(time), value, 1e-12) << time;
  EXPECT_NEAR(track.value(0.1), track.value(39.9), 1e-9);
  EXPECT_EQ(track.value(-3), -0.4);
  // Smooth: it rests at its ends and never leaves their range.
  EXPECT_LT(std::abs(track.value(0.01) - track.value(0)), 1e-5);
  for (double s = 0; s < 20; s += 0.05) {
    EXPECT_GE(track.value(s), -0.4 - 1e-12);
    EXPECT_LE(track.value(s), 0.4 + 1e-12);
  }
}

TEST(JuliaTimeline, KeyFramesAreMetInTheirOrder) {
  const auto t = parse_timeline("c.y=@0s:-0.4@5s:0.4@6.5:0.1@10s:-0.4; slice.offset = 0:0.5:2s");
  ASSERT_FALSE(t.ok()) << "spaces within a part";
  const auto two = parse_timeline("c.y=@0s:-0.4@5s:0.4@6.5:0.1@10s:-0.4; slice.offset=0:0.5:2s");
  ASSERT_TRUE(two.ok()) << two.error().text;
  for (const auto& [time, value] : {std::pair{0.0, -0.4}, {5.0, 0.4}, {6.5, 0.1}, {5.75, 0.25}, {15.0, 0.4}})
    EXPECT_NEAR(two->values(time).at("c.y"), value, 1e-12) << time;
  EXPECT_NEAR(two->values(2).at("slice.offset"), 0.5, 1e-12);
  EXPECT_EQ(two->values(2).size(), 2u);
}

TEST(JuliaTimeline, TextSaysTheSameAgain) {
  for (const char* text : {"c.y=-0.4:0.4:10s", "c.y=@0s:-0.4@5s:0.4@10s:-0.3", "c.x=0.1:0.3:1.5s;lod=@0s:1@2s:0.5"}) {
    const auto t = parse_timeline(text);
    ASSERT_TRUE(t.ok()) << text;
    EXPECT_EQ(t->text(), text);
  }
  const auto odd = parse_timeline("c.y=0.1:0.30000000000000004:3.3333333333333335s");
  ASSERT_TRUE(odd.ok());
  const auto again = parse_timeline(odd->text());
  ASSERT_TRUE(again.ok()) << odd->text();
  for (double s = 0; s < 7; s += 0.37) EXPECT_EQ(odd->values(s), again->values(s));
}

TEST(JuliaTimeline, WhatCannotBeReadIsNamed) {
  const std::vector<std::pair<std::string, const char*>> cases{
      {"", "NAME=FROM:TO:SECONDS"},
      {"c.y", "\"c.y\""},
      {"=0:1:1s", "NAME=FROM"},
      {"c.y=1:2", "NAME=FROM"},
      {"c.y=1:2:3s:4", "NAME=FROM"},
      {"c.y=a:2:3s", "\"a\" is no finite number"},
      {"c.y=nan:2:3s", "\"nan\" is no finite number"},
      {"c.y=1:inf:3s", "\"inf\""},
      {"c.y=1:2:3m", "\"3m\" is no time"},
      {"c.y=1:2:0s", "0 s"},
      {"c.y=1:2:-1s", "outside 0..1000000 s"},
      {"c.y=1:2:1e9s", "outside 0..1000000 s"},
      {"c.y=@0s:1", "at least 2"},
      {"c.y=@1s:1@2s:2", "must be at 0 s"},
      {"c.y=@0s:1@2s:2@2s:3", "does not come after"},
      {"c.y=@0s:1@2s:2@1s:3", "does not come after"},
      {"c.y=@0s:1@2s", "@SECONDS:VALUE"},
      {"c.y=0:1:1s;c.y=0:2:1s", "c.y is animated twice"},
      {"c.y=0:1:1s;;c.x=0:2:1s", "NAME=FROM"},
  };
  for (const auto& [text, part] : cases) {
    const auto t = parse_timeline(text);
    ASSERT_FALSE(t.ok()) << text;
    EXPECT_NE(t.error().text.find(part), std::string::npos) << t.error().text;
    EXPECT_LT(t.error().text.size(), 300u);
  }
  std::string many = "c.y=@0s:0";
  for (int i = 1; i <= 4096; ++i) many += fmt::format("@{}s:0", i);
  const auto t = parse_timeline(many);
  ASSERT_FALSE(t.ok());
  EXPECT_NE(t.error().text.find("4097 key frames, at most 4096"), std::string::npos);
}

TEST(JuliaAnimation, InstantsHoldEveryKeyFrameAndTheWholeTime) {
  EXPECT_EQ(instants({}, 24), std::vector<double>{0});
  const auto times = instants(*parse_timeline("c.y=@0s:0@0.123s:1@12s:0"), 24);
  EXPECT_EQ(times.front(), 0);
  EXPECT_NE(std::find(times.begin(), times.end(), 0.123), times.end());
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  for (size_t i = 1; i < times.size(); ++i) EXPECT_LE(times[i] - times[i - 1], 0.5 + 1e-12);
  EXPECT_LT(times.back(), 12);
}

TEST(JuliaAnimation, BoxHoldsTheSetAtEveryInstant) {
  Parameters p;
  const auto timeline = *parse_timeline("c.w=-1:0:3s");
  const AnimatedBounds all = animated_bounds(p, timeline);
  ASSERT_FALSE(all.box.empty());
  for (const double t : instants(timeline, 24)) {
    const auto box = bounds(*parameters_at(p, timeline, t));
    auto joined = all.box;
    joined.extend(box);
    EXPECT_EQ(joined, all.box) << t;
  }
  size_t last = 0, total = 0;
  (void)animated_bounds(p, timeline, [&](size_t done, size_t of) {
    EXPECT_GT(done, last);
    last = done, total = of;
  });
  EXPECT_EQ(last, total);
  EXPECT_EQ(total, instants(timeline, 24).size());
}

}  // namespace
}  // namespace telesplat::julia
