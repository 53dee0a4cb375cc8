// For any link and traffic: order is kept, no byte comes out before half a round trip, no span of time has more than
// the rate, and a busy link loses no time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tools/wan_relay/way.h"

namespace telesplat::wan_relay {
namespace {

using links::Link;

Link any_link(std::mt19937& random) {
  const auto between = [&](double lo, double hi) { return std::uniform_real_distribution(lo, hi)(random); };
  const auto sometimes = [&](double v) { return random() % 3 ? v : 0; };
  Link link{.rtt_s = sometimes(between(0, 0.4)),
            .rate_bit_s = sometimes(std::pow(10, between(4, 10))),
            .jitter_s = sometimes(between(0, 0.05))};
  if (random() % 2) {
    link.stall_every_s = between(0.05, 3);
    link.stall_s = link.stall_every_s * between(0.01, 0.9);
  }
  return link;
}

struct Passed {
  double in_s, out_s;
  size_t bytes;
};

std::vector<Passed> traffic(Shaper& shaper, double from_s, std::mt19937& random) {
  std::vector<Passed> out;
  double now = from_s;
  for (int i = 0; i < 2000; ++i) {
    if (random() % 4 == 0) now += std::exponential_distribution(200.0)(random);
    const size_t room = shaper.room(now);
    if (room < shaper.piece()) {
      now = std::max(now, shaper.room_at_s());
      continue;
    }
    const size_t bytes = 1 + random() % shaper.piece();
    out.push_back({now, shaper.pass(now, bytes), bytes});
  }
  return out;
}

class AnyLink : public ::testing::TestWithParam<int> {};

TEST_P(AnyLink, KeepsItsPromises) {
  std::mt19937 random(static_cast<unsigned>(GetParam()));
  const Link link = any_link(random);
  SCOPED_TRACE(text_of(link));
  const double from_s = 1000;
  Shaper shaper(link, from_s, unsigned(GetParam()));
  const auto passed = traffic(shaper, from_s, random);
  ASSERT_GT(passed.size(), 100u);
  size_t bytes = 0, biggest = 0;
  for (size_t i = 0; i < passed.size(); ++i) {
    ASSERT_GE(passed[i].out_s, passed[i].in_s + link.rtt_s / 2 - 1e-9);
    if (i) {
      ASSERT_GE(passed[i].out_s, passed[i - 1].out_s) << "overtaken";
    }
    biggest = std::max(biggest, passed[i].bytes);
    bytes += passed[i].bytes;
  }
  if (link.rate_bit_s == 0) return;
  // Bytes that have come out by a time passed the bottleneck before it; checks all spans from the begin.
  size_t so_far = 0;
  for (const Passed& p : passed) {
    so_far += p.bytes;
    const double least_s = double(so_far) * 8 / link.rate_bit_s;
    ASSERT_GE(p.out_s - from_s - link.rtt_s / 2, least_s - 1e-6) << "faster than the rate";
    // The delay is bounded by the queue, the piece that passes, stalls and the link's delay.
    const double queue_s = double(std::max<uint64_t>(queue_bytes(link), 2 * shaper.piece())) * 8 / link.rate_bit_s;
    const double open = link.stall_s > 0 ? 1 - link.stall_s / link.stall_every_s : 1;
    ASSERT_LE(p.out_s - p.in_s, queue_s / open + link.stall_s * 2 + link.rtt_s / 2 + link.jitter_s + 1e-6);
  }
  EXPECT_EQ(so_far, bytes);
  // Without jitter every span between two pieces is at least the time of its bytes.
  if (link.jitter_s > 0) return;
  for (size_t i = 1; i < passed.size(); ++i)
    ASSERT_GE(passed[i].out_s - passed[i - 1].out_s, double(passed[i].bytes) * 8 / link.rate_bit_s - 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AnyLink, ::testing::Range(0, 60));

TEST(BusyLink, CarriesItsRate) {
  Shaper shaper({.rtt_s = 0.05, .rate_bit_s = 2e7}, 0, 3);
  double now = 0, out = 0;
  size_t bytes = 0;
  while (now < 10) {
    while (shaper.room(now) >= shaper.piece()) {
      out = shaper.pass(now, shaper.piece());
      bytes += shaper.piece();
    }
    now = shaper.room_at_s();
  }
  EXPECT_NEAR(double(bytes) * 8 / (out - 0.025), 2e7, 2e7 * 1e-3);
}

}  // namespace
}  // namespace telesplat::wan_relay
