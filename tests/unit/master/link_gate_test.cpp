#include "services/master/tiles/pacing.h"

#include <gtest/gtest.h>

namespace telesplat::master {
namespace {

constexpr InstanceId kNear{1}, kFar{2};

wire::LinkReport link(InstanceId viewer, double rate_bytes_s, uint64_t backlog, double rtt_s = 0.02,
                      double oldest_s = 0) {
  return {viewer, rate_bytes_s, backlog, rtt_s, oldest_s};
}

TEST(LinkGate, IsOpenToWhomItKnowsNothingOf) {
  LinkGate gate;
  EXPECT_TRUE(gate.open(kFar, 1));
  EXPECT_TRUE(gate.idle(1));
  EXPECT_EQ(gate.update_rays(kFar), 0u);
  // A link of unknown rate must have some bytes under way to learn the rate.
  gate.report(link(kFar, 0, 100'000), 1);
  EXPECT_TRUE(gate.open(kFar, 1));
  EXPECT_FALSE(gate.idle(1));
  gate.report(link(kFar, 0, 300'000), 1);
  EXPECT_FALSE(gate.open(kFar, 1));
}

TEST(LinkGate, ClosesWhenMoreWaitsThanTheLinkHolds) {
  LinkGate gate;
  gate.report(link(kFar, 2.5e6, 0), 1);
  EXPECT_TRUE(gate.open(kFar, 1));
  gate.published(170'000, 0, 1);  // 20 ms under way, 50 ms waiting: 175,000
  EXPECT_TRUE(gate.open(kFar, 1));
  EXPECT_FALSE(gate.idle(1)) << "nothing beyond views while something waits";
  gate.published(10'000, 0, 1);
  EXPECT_FALSE(gate.open(kFar, 1));
  gate.report(link(kFar, 2.5e6, 40'000), 1.1);
  EXPECT_TRUE(gate.open(kFar, 1.1));
  EXPECT_TRUE(gate.idle(1.1)) << "what is under way does not wait";
}

TEST(LinkGate, OneViewersLinkDoesNotHoldUpAnother) {
  LinkGate gate;
  gate.report(link(kFar, 1e5, 1'000'000), 1);
  gate.report(link(kNear, 1e8, 0), 1);
  EXPECT_FALSE(gate.open(kFar, 1));
  EXPECT_TRUE(gate.open(kNear, 1));
}

TEST(LinkGate, AViewerThatDoesNotReadIsSentNothingAndHoldsUpNobody) {
  LinkGate gate;
  gate.report(link(kFar, 0, 1000, 0.02, 3), 1);
  EXPECT_FALSE(gate.open(kFar, 1));
  EXPECT_TRUE(gate.idle(1));
  // A viewer may also stay silent.
  gate.report(link(kFar, 2.5e6, 10'000, 0.02, 0.1), 2);
  EXPECT_TRUE(gate.open(kFar, 2));
  EXPECT_FALSE(gate.open(kFar, 2 + LinkGate::kSilent_s));
  gate.report(link(kFar, 2.5e6, 0), 9);
  EXPECT_TRUE(gate.open(kFar, 9));
  gate.forget(kFar);
  EXPECT_TRUE(gate.figures(kFar).empty());
}

TEST(LinkGate, AnUpdateHasTheRaysThatALinkCarriesInItsTime) {
  LinkGate gate;
  gate.report(link(kFar, 2.5e6, 0), 1);
  for (int i = 0; i < 200; ++i) gate.published(3000, 1000, 1);
  const double bytes = LinkGate::kSpeedShare * 2.5e6 * LinkGate::kUpdate_s;
  EXPECT_NEAR(double(gate.update_rays(kFar)), bytes / 3, 2);
  gate.report(link(kFar, 10, 0), 1);
  EXPECT_EQ(gate.update_rays(kFar), LinkGate::kLeastRays);
}

TEST(LinkGate, AWishedRateIsKeptThoughTheLinkIsFaster) {
  LinkGate gate;
  gate.set_most(1e6);
  gate.report(link(kNear, 1e9, 0), 1);
  double now = 1, sent = 0;
  for (; now < 11; now += 0.001) {
    if (!gate.open(kNear, now)) continue;
    gate.published(5000, 2000, now);
    gate.report(link(kNear, 1e9, 0), now);
    sent += 5000;
  }
  EXPECT_NEAR(sent / 10, 1e6, 0.03e6);
  EXPECT_EQ(gate.update_rays(kNear), uint64_t(1e6 * LinkGate::kUpdate_s / 2.5));
}

TEST(LinkGate, TellsFigures) {
  LinkGate gate;
  gate.report(link(kFar, 2.5e6, 1000, 0.05), 1);
  gate.published(500, 0, 1);
  EXPECT_EQ(gate.figures(kFar),
            (std::map<std::string, double>{{"backlog_bytes", 1500}, {"link_mbit", 20}, {"rtt_ms", 50}}));
}

}  // namespace
}  // namespace telesplat::master
