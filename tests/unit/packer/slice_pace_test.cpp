// Frames of a volume on links of all kinds: the link stays busy, and no frame waits long before it.
#include <gtest/gtest.h>

#include <algorithm>
#include <queue>
#include <vector>

#include "services/packer/slices/gatherer.h"

namespace telesplat::packer {
namespace {

struct Link {
  double bytes_s, rtt_s;
};
struct Outcome {
  double busy = 0;            // share of the time in which the link carried bytes
  double longest_wait_s = 0;  // longest wait of a frame before the link
  uint64_t frames = 0;
};

// A viewer with two buffers on a link; a new frame every period_s; the newest goes out when the pace allows.
Outcome play(SlicePace& pace, const Link& link, double period_s, uint64_t bytes, double from_s, double until_s) {
  struct Ack {
    FrameId frame;
    double at_s;
  };
  Outcome out;
  std::queue<Ack> acks;
  double free_s = from_s, carried_s = 0, sampled_s = from_s;
  uint64_t newest = 0;
  static FrameId next{1};
  for (double now_s = from_s; now_s < until_s; now_s += 0.001) {
    for (; !acks.empty() && acks.front().at_s <= now_s; acks.pop()) pace.acknowledged(acks.front().frame, now_s);
    if (now_s >= sampled_s) ++newest, sampled_s += period_s;
    if (newest == 0 || acks.size() >= 2 || now_s < pace.next_s()) continue;
    newest = 0;
    const FrameId frame = next;
    next = next.next();
    pace.sent(frame, bytes, now_s);
    const double begin_s = std::max(now_s, free_s), takes_s = static_cast<double>(bytes) / link.bytes_s;
    // The first frames measure the rate.
    if (now_s > from_s + 2) out.longest_wait_s = std::max(out.longest_wait_s, begin_s - now_s);
    free_s = begin_s + takes_s;
    carried_s += takes_s;
    acks.push({frame, free_s + link.rtt_s});
    ++out.frames;
  }
  out.busy = carried_s / (until_s - from_s);
  return out;
}

TEST(SlicePace, ASlowLinkIsBusyAndNothingWaitsBeforeIt) {
  for (const double rtt_s : {0.0005, 0.05, 0.3})
    for (const double bytes_s : {2.5e6, 1e6, 4e6}) {
      SlicePace pace;
      const uint64_t bytes = 500'000;
      const double takes_s = static_cast<double>(bytes) / bytes_s;
      const Outcome out = play(pace, {bytes_s, rtt_s}, 0.02, bytes, 0, 30);
      // At most two frames are under way: a much longer link cannot be filled.
      const double most = std::min(1.0, 2 * takes_s / (takes_s + rtt_s));
      EXPECT_GT(out.busy, (rtt_s > 0.1 ? 0.75 : 0.85) * most) << bytes_s << " bytes/s, " << rtt_s << " s";
      EXPECT_LT(out.longest_wait_s, 0.3 * takes_s) << bytes_s << " bytes/s, " << rtt_s << " s";
    }
}

TEST(SlicePace, AFastLinkTakesTwoAtOnce) {
  SlicePace pace;
  for (uint64_t i = 1; i <= 10; ++i) {
    pace.sent({i}, 500'000, static_cast<double>(i));
    EXPECT_LE(pace.next_s(), static_cast<double>(i)) << "frame " << i;
    pace.acknowledged({i}, static_cast<double>(i) + 0.02);
  }
}

TEST(SlicePace, NothingIsKnownBeforeTheFirstAcknowledgement) {
  SlicePace pace;
  EXPECT_LE(pace.next_s(), 0);
  pace.sent({1}, 1'000'000, 5);
  EXPECT_LE(pace.next_s(), 5);
  pace.acknowledged({9}, 6);  // never sent
  EXPECT_EQ(pace.rate_bytes_s(), 0);
  pace.acknowledged({1}, 6);
  EXPECT_DOUBLE_EQ(pace.rate_bytes_s(), 1e6);
}

TEST(SlicePace, FollowsALinkThatBecomesSlowerOrFaster) {
  SlicePace pace;
  const uint64_t bytes = 500'000;
  play(pace, {4e6, 0.02}, 0.02, bytes, 0, 20);
  EXPECT_NEAR(pace.rate_bytes_s(), 4e6, 0.5e6);
  play(pace, {1e6, 0.02}, 0.02, bytes, 20, 40);
  EXPECT_NEAR(pace.rate_bytes_s(), 1e6, 0.1e6);
  play(pace, {4e6, 0.02}, 0.02, bytes, 40, 50);
  EXPECT_NEAR(pace.rate_bytes_s(), 4e6, 0.5e6);
}

TEST(SlicePace, WhatIsLostHoldsUpNothing) {
  SlicePace pace;
  pace.sent({1}, 500'000, 0);
  pace.acknowledged({1}, 1);
  pace.sent({2}, 500'000, 1);
  EXPECT_GT(pace.next_s(), 1.5);
  pace.lost();
  EXPECT_LE(pace.next_s(), 1);
}

TEST(SlicePace, WhatWasSentTwiceOrAcknowledgedTogetherTellsNothing) {
  SlicePace pace;
  pace.sent({1}, 500'000, 0);
  pace.acknowledged({1}, 0.5);
  pace.sent({2}, 500'000, 1);
  pace.lost();  // it was late, and arrives after all
  pace.sent({2}, 500'000, 3);
  pace.acknowledged({2}, 3.01);
  EXPECT_DOUBLE_EQ(pace.rate_bytes_s(), 1e6);
  pace.sent({3}, 500'000, 4);
  pace.sent({4}, 500'000, 4);
  pace.acknowledged({3}, 5.0005);
  pace.acknowledged({4}, 5.001);
  EXPECT_DOUBLE_EQ(pace.rate_bytes_s(), 1e6);
}

TEST(SlicePace, NoMoreThanIsWished) {
  SlicePace pace;
  pace.set_most(1e6);
  const Outcome out = play(pace, {100e6, 0.001}, 0.02, 500'000, 0, 30);
  EXPECT_GE(out.frames, 58u);
  EXPECT_LE(out.frames, 61u);
}

}  // namespace
}  // namespace telesplat::packer
