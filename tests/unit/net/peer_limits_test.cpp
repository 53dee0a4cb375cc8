// A peer's share of a socket: messages a second, and bytes that wait for it.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "common/net/connections/peer_rates.h"
#include "common/net/connections/queued_bytes.h"
#include "common/net/service.h"

namespace telesplat::net {
namespace {

TEST(PeerRates, OneThatFloodsIsNoOthersBusiness) {
  PeerRates rates(1000);
  int heard = 0, others = 0;
  for (int i = 0; i < 100'000; ++i) {
    heard += rates.admit("flood", 1 + 1e-5 * i);
    if (i % 200 == 0) others += rates.admit("other", 1 + 1e-5 * i);
  }
  EXPECT_GE(heard, 2999) << "two seconds' worth at once, and a second's";
  EXPECT_LE(heard, 3001);
  EXPECT_EQ(others, 500);
  EXPECT_EQ(rates.refused(), 100'000u - uint64_t(heard));
  EXPECT_TRUE(rates.admit("flood", 3)) << "later it is heard again";
}

TEST(WorkShares, LargeMessagesAreNoOthersBusiness) {
  WorkShares work;
  double took_s = 0;
  int others = 0;
  for (double now_s = 1; now_s < 11; now_s += 0.01) {
    if (work.admit("flood", now_s)) work.worked("flood", 0.03, now_s), took_s += 0.03;
    if (work.admit("other", now_s)) work.worked("other", 0.001, now_s), ++others;
  }
  EXPECT_NEAR(took_s, WorkShares::kBurst_s + 10 * WorkShares::kShare, 0.05);
  EXPECT_GE(others, 1000) << "it takes a tenth of the time";
  EXPECT_GT(work.refused(), 800u);
  work.worked("other", 0.001, 20);
  EXPECT_TRUE(work.admit("flood", 20)) << "later it is heard again";
}

TEST(WorkShares, GuestsPayByTheirKeysAndOperatorsDoNot) {
  Message message;
  message.peer = "connection";
  EXPECT_EQ(*payer(message), "connection") << "without keys";
  message.user = "anna", message.role = Role::kViewer;
  EXPECT_EQ(*payer(message), "anna");
  message.role = Role::kOperator;
  EXPECT_EQ(payer(message), nullptr);
}

TEST(PeerRates, RemembersOnlySoManyPeers) {
  PeerRates rates(10);
  int heard = 0;
  for (int i = 0; i < 20'000; ++i) heard += rates.admit("stranger " + std::to_string(i), 1);
  EXPECT_LT(heard, 4200) << "those beyond share one";
}

TEST(QueuedBytes, CountsWhatIsUnderWayToEachPeer) {
  QueuedBytes queued(100);
  EXPECT_TRUE(queued.has_room("a", 1000)) << "one message of any size";
  {
    const auto large = queued.add("a", 1000);
    EXPECT_EQ(queued.of("a"), 1000u);
    EXPECT_FALSE(queued.has_room("a", 1));
    EXPECT_TRUE(queued.has_room("b", 60));
  }
  {
    const auto of_b = queued.add("b", 60);
    EXPECT_TRUE(queued.has_room("b", 40));
    EXPECT_FALSE(queued.has_room("b", 41));
  }
  EXPECT_EQ(queued.of("a"), 0u);
  EXPECT_TRUE(queued.has_room("a", 100));
}

TEST(QueuedBytes, ManyPeersTogetherHaveHardlyMoreThanTwo) {
  QueuedBytes queued(1'000'000);
  std::vector<QueuedBytes::Ticket> tickets;
  const auto fill = [&](const std::string& peer) {
    while (queued.has_room(peer, 1000)) tickets.push_back(queued.add(peer, 1000));
  };
  for (int i = 0; i < 100; ++i) fill("greedy " + std::to_string(i));
  EXPECT_LT(queued.of_all(), 2'700'000u);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(queued.has_room("honest", 300)) << "one that reads";
    tickets.push_back(queued.add("honest", 300));
  }
  tickets.clear();
  EXPECT_EQ(queued.of_all(), 0u);
}

// A message may outlive the peer, and the socket that sent it.
TEST(QueuedBytes, TicketsOutlastTheirPeers) {
  auto queued = std::make_unique<QueuedBytes>(100);
  auto ticket = std::make_unique<QueuedBytes::Ticket>(queued->add("a", 80));
  for (int i = 0; i < 5000; ++i) queued->add("guest " + std::to_string(i), 1);
  EXPECT_EQ(queued->of("a"), 80u) << "only those for whom nothing waits are forgotten";
  EXPECT_EQ(queued->of("guest 0"), 0u);
  queued.reset();
  ticket.reset();
}

TEST(Service, OpensAsManyFilesAsItMay) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit few{256, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  EXPECT_EQ(raise_file_limit(), before.rlim_max);
  rlimit now{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &now), 0);
  EXPECT_EQ(now.rlim_cur, before.rlim_max);
  setrlimit(RLIMIT_NOFILE, &before);
}

}  // namespace
}  // namespace telesplat::net
