// Faults, links and keys of the simulated network.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/net/socket.h"
#include "common/wire/messages.h"
#include "tools/lab/simulation/network/network.h"
#include "tools/lab/simulation/network/pipes.h"

namespace telesplat::simulation {
namespace {

using net::Kind;
using net::Role;

// A router of process 0 and a dealer of process 1, which are connected.
class Faults : public ::testing::Test {
 protected:
  explicit Faults(uint64_t seed = 1) : network(seed) {
    server = std::make_unique<net::Context>(network.attach(0));
    client = std::make_unique<net::Context>(network.attach(1));
    router.emplace(*server, Kind::kRouter, "router");
    dealer.emplace(*client, Kind::kDealer, "dealer", net::SocketOptions{.watch_connecting = true, .read_ahead = true});
    at = *router->bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(dealer->connect(at).ok());
    say("hello");
    network.advance(1);
    peer = router->receive()->peer;
  }
  bool say(std::string text) { return dealer->send_frames({}, "x", std::move(text)); }
  bool answer(std::string text) { return router->send_frames(peer, "x", std::move(text)); }
  static std::string text(const std::optional<net::Message>& m) {
    return m ? std::string(reinterpret_cast<const char*>(m->body.data()), m->body.size()) : "nothing";
  }

  SimulatedNetwork network;
  std::unique_ptr<net::Context> server, client;
  std::optional<net::Socket> router, dealer;
  std::string at, peer;
};

TEST_F(Faults, AMessageTakesALinksLatencyAndItsBytesTheirTime) {
  network.set_link(0, 1, {.latency_s = 0.2, .bytes_s = 1000});
  ASSERT_TRUE(answer(std::string(995, 'x')));  // and a type, and 4 bytes
  ASSERT_TRUE(answer("second"));
  network.advance(2.19);
  EXPECT_FALSE(net::wait_readable({&*dealer}, 1000));
  network.advance(2.205);
  EXPECT_TRUE(net::wait_readable({&*dealer}, 1000));
  network.advance(5);
  EXPECT_DOUBLE_EQ(dealer->receive()->arrived_s, 2.2);
  EXPECT_DOUBLE_EQ(dealer->receive()->arrived_s, 2.211);
}

TEST_F(Faults, MessagesKeepTheirOrderWhateverTheirJitter) {
  network.set_link(1, 0, {.latency_s = 0.001, .jitter_s = 0.5});
  for (int i = 0; i < 100; ++i) {
    say(std::to_string(i));
    network.advance(network.now_s() + 0.01);
  }
  network.advance(10);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(text(router->receive()), std::to_string(i));
}

TEST_F(Faults, WhatIsOnTheWireOfAKilledProcessArrivesAndWhatWaitsIsLost) {
  network.set_link(1, 0, {.latency_s = 0.1, .bytes_s = 20000, .buffer_bytes = 1000});
  say(std::string(2000, 'x'));
  say("waits");
  network.crash(1);
  EXPECT_FALSE(say("dead"));
  dealer.reset();
  network.advance(1.21);
  EXPECT_EQ(text(router->receive()).size(), 2000u);
  EXPECT_FALSE(answer("too late"));
  network.advance(3);
  EXPECT_FALSE(router->receive());
}

TEST_F(Faults, AProcessCanBeKilledAtAnyMessageThatItSends) {
  int seen = 0;
  network.on_passed = [&](const Passed& p) {
    if (p.what == Passed::What::kSent && ++seen == 3) network.crash(p.from);
  };
  std::vector<bool> sent;
  for (const char* text : {"one", "two", "three", "four"}) sent.push_back(say(text));
  EXPECT_EQ(sent, (std::vector<bool>{true, true, false, false}));
  dealer.reset();
  network.advance(2);
  EXPECT_EQ(text(router->receive()), "one");
  EXPECT_EQ(text(router->receive()), "two");
  EXPECT_FALSE(router->receive());
}

TEST_F(Faults, AProcessCanBeKilledAtAnyMessageThatComes) {
  for (const char* text : {"one", "two", "three"}) ASSERT_TRUE(say(text));
  int seen = 0;
  network.on_passed = [&](const Passed& p) {
    if (p.what == Passed::What::kDelivered && ++seen == 2) network.crash(p.to);
  };
  network.advance(2);
  EXPECT_FALSE(router->receive());
  EXPECT_EQ(seen, 2);
  EXPECT_FALSE(dealer->in_touch());
}

TEST_F(Faults, ThoseWhoWereConnectedToAKilledProcessFindTheNextOneInItsPlace) {
  network.crash(0);
  router.reset();
  network.advance(2);
  EXPECT_GE(dealer->failed_connections(), 3u);
  EXPECT_LE(dealer->failed_connections(), 6u) << "waits grow";
  EXPECT_FALSE(dealer->in_touch());
  say("to the next one");
  net::Context next(network.attach(2));
  net::Socket again(next, Kind::kRouter, "again");
  ASSERT_TRUE(again.bind(at).ok());
  network.advance(3);
  EXPECT_TRUE(dealer->in_touch());
  EXPECT_EQ(text(again.receive()), "to the next one");
}

TEST_F(Faults, AfterAShortSilenceBytesArriveLate) {
  network.silence(0, 1, 5);
  say("late");
  ASSERT_TRUE(answer("likewise"));
  network.advance(5.9);
  EXPECT_FALSE(router->receive());
  network.advance(6.1);
  EXPECT_EQ(text(router->receive()), "late");
  EXPECT_EQ(text(dealer->receive()), "likewise");
  network.advance(10);
  network.silence(0, 1, 5);
  network.advance(30);
  EXPECT_EQ(dealer->failed_connections(), 0u) << "two short ones are no long one";
}

TEST_F(Faults, ALongSilenceIsTakenForABrokenConnection) {
  network.silence(0, 1, 30);
  say("lost");
  network.advance(10.9);
  EXPECT_TRUE(dealer->in_touch());
  EXPECT_TRUE(answer("lost")) << "neither has noticed";
  network.advance(11.1);
  EXPECT_FALSE(dealer->in_touch());
  EXPECT_FALSE(answer("too late"));
  say("after");
  network.advance(33);
  EXPECT_TRUE(dealer->in_touch());
  EXPECT_EQ(text(router->receive()), "after");
  EXPECT_FALSE(dealer->receive());
}

// Its kernel keeps the time.
TEST_F(Faults, AStoppedProcessFindsAConnectionBrokenThatWasSilentForLong) {
  network.stop(1);
  network.silence(0, 1, 15);
  network.advance(20);
  network.go_on(1);
  network.advance(20.01);
  EXPECT_EQ(dealer->failed_connections(), 1u);
  network.advance(21);
  EXPECT_TRUE(dealer->in_touch());
}

TEST_F(Faults, AResetLosesWhatIsOnTheWire) {
  network.set_links({.latency_s = 0.1});
  network.set_link(0, 1, {.buffer_bytes = 1});
  int dropped = 0;
  network.on_passed = [&](const Passed& p) { dropped += p.what == Passed::What::kDropped; };
  say("lost");
  ASSERT_TRUE(answer("lost") && answer("waits"));
  EXPECT_GT(router->queued_bytes(peer), 0u);
  network.break_connections(0, 1);
  network.advance(1.5);
  EXPECT_FALSE(router->receive());
  EXPECT_EQ(router->queued_bytes(peer), 0u);
  EXPECT_EQ(dropped, 3);
  say("after");
  network.advance(3);
  EXPECT_EQ(text(router->receive()), "after");
}

TEST_F(Faults, AStoppedProcessTakesPartAgainWhereItStopped) {
  network.stop(1);
  ASSERT_TRUE(answer("waits"));
  network.advance(20);
  EXPECT_TRUE(answer("too"));
  network.advance(21);
  network.go_on(1);
  network.advance(22);
  const auto first = dealer->receive();
  EXPECT_EQ(text(first), "waits");
  EXPECT_DOUBLE_EQ(first->arrived_s, 21);
  EXPECT_EQ(text(dealer->receive()), "too");
}

TEST_F(Faults, WhatIsDueIsSaidWhileTheOwnerTakesNoTurn) {
  net::Socket busy(*client, Kind::kDealer, "busy", {.read_ahead = true});
  int n = 0;
  busy.set_due([&] { return std::optional(std::pair(std::string("sign"), std::to_string(n++))); });
  ASSERT_TRUE(busy.connect(at).ok());
  EXPECT_FALSE(busy.receive());
  network.advance(2.05);
  int got = 0;
  while (router->receive()) ++got;
  EXPECT_EQ(got, 11);
  network.stop(1);
  network.advance(4);
  EXPECT_FALSE(router->receive());
  network.go_on(1);
  network.advance(4.01);
  EXPECT_EQ(text(router->receive()), "11");
  EXPECT_FALSE(router->receive()) << "it was not asked while it was stopped";
}

TEST_F(Faults, AConnectionEndsOnceItsOwnerHasEndedAndAllIsSent) {
  network.set_link(1, 0, {.buffer_bytes = 1});
  say("first");
  say("last");
  dealer.reset();
  network.advance(1.1);
  EXPECT_EQ(text(router->receive()), "first");
  EXPECT_EQ(text(router->receive()), "last");
  EXPECT_FALSE(answer("too late"));
}

TEST(SimulatedPipe, LearnsInStepsOfHalfItsMarkWhatWasTaken) {
  Pipe pipe(8);
  for (int i = 0; i < 8; ++i) pipe.push({.body = std::make_shared<const std::string>()});
  for (int i = 0; i < 3; ++i) pipe.pop();
  EXPECT_TRUE(pipe.full());
  pipe.pop();
  EXPECT_FALSE(pipe.full());
}

TEST(SimulatedSockets, EachConnectionIsReadInTurn) {
  SimulatedNetwork network(1);
  net::Context context(network.attach(0));
  net::Socket pull(context, Kind::kPull, "pull"), a(context, Kind::kPush, "a"), b(context, Kind::kPush, "b");
  const std::string at = *pull.bind("tcp://127.0.0.1:*");
  for (net::Socket* push : {&a, &b}) {
    ASSERT_TRUE(push->connect(at).ok());
    for (int i = 0; i < 3; ++i) push->send_frames({}, push->name(), {});
  }
  network.advance(1);
  for (int i = 0; i < 3; ++i)
    for (const char* from : {"a", "b"}) {
      const auto m = pull.receive();
      ASSERT_TRUE(m);
      EXPECT_EQ(m->type, from);
      EXPECT_EQ(m->peer, "");
    }
}

TEST(SimulatedSockets, ASubscriberMissesWhatIsPublishedBeforeItsSubscriptionArrives) {
  SimulatedNetwork network(1);
  network.set_links({.latency_s = 0.1});
  net::Context context(network.attach(0));
  net::Socket publisher(context, Kind::kPub, "pub"), subscriber(context, Kind::kSub, "sub");
  ASSERT_TRUE(subscriber.connect(*publisher.bind("tcp://127.0.0.1:*")).ok());
  for (const double when_s : {0.45, 0.65, 0.75}) {
    network.advance(when_s);
    EXPECT_TRUE(publisher.send_frames({}, std::to_string(when_s).substr(0, 4), {}));
  }
  network.advance(1);
  const auto m = subscriber.receive();
  ASSERT_TRUE(m);
  EXPECT_EQ(m->type, "0.75");
}

TEST(SimulatedKeys, ARoleSendsOnlyWhatIsItsOwn) {
  SimulatedNetwork network(1);
  net::Context master(network.attach(0, {.key = Identity{"server", Role::kServer}}));
  net::Context anna(network.attach(1, {.key = Identity{"anna", Role::kViewer}}));
  net::Context stranger(network.attach(2)), sampler(network.attach(3, {.key = Identity{"s", Role::kSampler}}));
  net::Socket control(master, Kind::kRouter, "master", {.serves = "control"});
  net::Socket tiles(master, Kind::kPull, "tiles", {.serves = "tiles"});
  const std::string at = *control.bind("tcp://127.0.0.1:*"), at_tiles = *tiles.bind("tcp://127.0.0.1:*");
  net::Socket a(anna, Kind::kDealer, "anna"), b(stranger, Kind::kDealer, "stranger", {.watch_connecting = true});
  net::Socket pushes(anna, Kind::kPush, "pushes", {.watch_connecting = true});
  ASSERT_TRUE(a.connect(at).ok() && b.connect(at).ok() && pushes.connect(at_tiles).ok());
  a.send_frames({}, "lease_request", "not hers");
  a.send_frames({}, "hello", "hers");
  b.send_frames({}, "hello", "without a key");
  network.advance(0.1);
  const auto got = control.receive();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->type, "hello");
  EXPECT_EQ(got->user, "anna");
  EXPECT_EQ(got->role, Role::kViewer);
  EXPECT_FALSE(control.receive());
  EXPECT_EQ(control.rejected(), 1u);
  EXPECT_GE(control.keys_refused(), 1u);
  EXPECT_EQ(b.failed_connections(), 0u) << "a server was there";
  EXPECT_NE(b.refusal().text.find("wants a key"), std::string::npos);
  EXPECT_GE(tiles.keys_refused(), 1u);
  EXPECT_NE(pushes.refusal().text.find("anna is not let in"), std::string::npos);
}

// Everything that passes, as text.
std::string trace(uint64_t seed) {
  SimulatedNetwork network(seed);
  network.set_links({.latency_s = 0.01, .jitter_s = 0.02});
  std::string out;
  int on_its_way = 0;
  network.on_passed = [&](const Passed& p) {
    if (!p.body.empty()) on_its_way += p.what == Passed::What::kSent ? 1 : -1;
    out += std::to_string(p.now_s) + " " + std::to_string(int(p.what)) + " " + std::to_string(p.from) + " " +
           std::to_string(p.to) + "\n";
  };
  net::Context server(network.attach(0));
  net::Socket pull(server, Kind::kPull, "pull", {.high_water_mark = 4});
  const std::string at = *pull.bind("tcp://127.0.0.1:*");
  std::vector<std::unique_ptr<net::Context>> contexts;
  std::vector<net::Socket> pushes;
  for (int i = 1; i < 5; ++i) {
    contexts.push_back(std::make_unique<net::Context>(network.attach(i)));
    pushes.emplace_back(*contexts.back(), Kind::kPush, "push", net::SocketOptions{.high_water_mark = 4});
    EXPECT_TRUE(pushes.back().connect(at).ok());
  }
  for (int n = 0; n < 200; ++n) {
    for (auto& push : pushes) push.send_frames({}, "x", std::string(10, 'x'));
    network.advance(network.now_s() + 0.01);
    if (n % 2) pull.receive();
    if (n == 100) network.crash(3);
    if (n == 120) network.break_connections(0, 2);
  }
  pushes.clear();
  for (int n = 0; n < 100; ++n) {
    network.advance(network.now_s() + 0.01);
    while (pull.receive()) {
    }
  }
  EXPECT_EQ(on_its_way, 0) << "each message came, or was dropped";
  return out;
}

TEST(SimulatedReplay, TheSameSeedGivesTheSameMessages) {
  EXPECT_EQ(trace(7), trace(7));
  EXPECT_NE(trace(7), trace(8));
}

}  // namespace
}  // namespace telesplat::simulation
