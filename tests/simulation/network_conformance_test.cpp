// Messages that a socket keeps, drops and refuses: each test runs over ZeroMQ and TCP, and over the simulated network.
#include <gtest/gtest.h>

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/core/clock.h"
#include "common/net/socket.h"
#include "tests/support/patience.h"
#include "tools/lab/simulation/network/network.h"

namespace telesplat::simulation {
namespace {

using net::Kind;
using net::Message;
using net::SocketOptions;

constexpr size_t kLarge = 64 << 10;
constexpr size_t kKernels = 32 << 20;  // more than two kernels keep of a connection

// The socket of a process of its own.
struct Peer {
  std::unique_ptr<net::Context> context;
  std::unique_ptr<net::Socket> socket;
  net::Socket* operator->() const { return socket.get(); }
  void end() { socket.reset(), context.reset(); }
};

class Bed {
 public:
  virtual ~Bed() = default;
  virtual std::unique_ptr<net::Context> process() = 0;
  virtual void wait(net::Socket* socket) = 0;  // some milliseconds
  virtual double now_s() = 0;
  virtual void break_connections(const std::string& endpoint) = 0;

  Peer peer(Kind kind, const SocketOptions& options = {}) {
    Peer out{process(), nullptr};
    out.socket = std::make_unique<net::Socket>(*out.context, kind, "peer", options);
    return out;
  }
  Peer bound(Kind kind, std::string& endpoint, const SocketOptions& options = {}) {
    Peer out = peer(kind, options);
    const auto at = endpoint.empty() ? "tcp://127.0.0.1:*" : endpoint;
    EXPECT_TRUE(until([&] {  // a port becomes free some time after its socket was closed
      const auto bound = out->bind(at);
      if (bound) endpoint = *bound;
      return bound.ok();
    }));
    return out;
  }
  Peer connected(Kind kind, const std::string& endpoint, const SocketOptions& options = {}) {
    Peer out = peer(kind, options);
    EXPECT_TRUE(out->connect(endpoint).ok());
    return out;
  }
  bool until(const std::function<bool()>& done, net::Socket* socket = nullptr) {
    for (const double deadline_s = now_s() + test::patient(20); now_s() < deadline_s; wait(socket))
      if (done()) return true;
    return done();
  }
  std::optional<Message> next(const Peer& peer) {
    std::optional<Message> out;
    until([&] { return (out = peer->receive()).has_value(); }, peer.socket.get());
    return out;
  }
};

class RealBed final : public Bed {
 public:
  std::unique_ptr<net::Context> process() override { return std::make_unique<net::Context>(); }
  void wait(net::Socket* socket) override {
    net::wait_readable(socket ? std::vector{socket} : std::vector<net::Socket*>{}, 5);
  }
  double now_s() override { return monotonic_s(); }
  void break_connections(const std::string& endpoint) override {
    const int port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
    for (int fd = 0; fd < 1024; ++fd) {
      sockaddr_in to{};
      socklen_t size = sizeof to;
      if (getpeername(fd, reinterpret_cast<sockaddr*>(&to), &size) == 0 && ntohs(to.sin_port) == port)
        ::shutdown(fd, SHUT_RDWR);
    }
  }
};

class SimulatedBed final : public Bed {
 public:
  std::unique_ptr<net::Context> process() override {
    return std::make_unique<net::Context>(network_.attach(processes_++));
  }
  void wait(net::Socket*) override { network_.advance(network_.now_s() + 0.005); }
  double now_s() override { return network_.now_s(); }
  void break_connections(const std::string&) override {
    for (int a = 0; a < processes_; ++a)
      for (int b = 0; b < a; ++b) network_.break_connections(a, b);
  }

 private:
  SimulatedNetwork network_{1};
  int processes_ = 0;
};

class Network : public ::testing::TestWithParam<bool> {
 protected:
  Network() {
    if (GetParam())
      bed_ = std::make_unique<SimulatedBed>();
    else
      bed_ = std::make_unique<RealBed>();
  }
  // Sends until it was refused 80 times at 5 ms. Returns how many were taken.
  int fill(const Peer& peer, std::string_view to = {}) {
    int sent = 0;
    for (int refused = 0; refused < 80 && sent < 10000;) {
      if (send(peer, sent, kLarge, to))
        ++sent, refused = 0;
      else
        ++refused, bed_->wait(nullptr);
    }
    return sent;
  }
  static bool send(const Peer& peer, int number, size_t bytes = sizeof(int), std::string_view to = {}) {
    std::string body(bytes, 'x');
    std::memcpy(body.data(), &number, sizeof number);
    return peer->send_frames(to, "x", std::move(body));
  }
  static int number(const std::optional<Message>& message) {
    int out = -1;
    if (message && message->body.size() >= sizeof out) std::memcpy(&out, message->body.data(), sizeof out);
    return out;
  }
  // The numbers of all messages up to `last`.
  std::vector<int> numbers_until(const Peer& peer, int last) {
    std::vector<int> out;
    do out.push_back(number(bed_->next(peer)));
    while (out.back() != last && out.back() != -1);
    return out;
  }
  // Publishes until it is subscribed.
  void subscribe(const Peer& publisher, const Peer& subscriber) {
    ASSERT_TRUE(bed_->until(
        [&] {
          send(publisher, -2);
          return subscriber->receive().has_value();
        },
        subscriber.socket.get()));
  }

  std::unique_ptr<Bed> bed_;
  std::string at_;
};

INSTANTIATE_TEST_SUITE_P(, Network, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "Simulated" : "ZeroMq"; });

TEST_P(Network, APublisherDropsBeyondTheMarkOfASlowSubscriberAndSendsOn) {
  Peer publisher = bed_->bound(Kind::kPub, at_, {.high_water_mark = 10});
  Peer slow = bed_->connected(Kind::kSub, at_, {.high_water_mark = 10});
  Peer reads = bed_->connected(Kind::kSub, at_, {.high_water_mark = 10});
  subscribe(publisher, slow);
  subscribe(publisher, reads);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(send(publisher, i, kLarge)) << i;
    ASSERT_TRUE(bed_->until([&, i] { return number(reads->receive()) == i; }, reads.socket.get())) << i;
  }
  const int end = 1000;
  std::vector<int> got;
  ASSERT_TRUE(bed_->until([&] {
    send(publisher, end);
    while (const auto m = slow->receive()) got.push_back(number(m));
    return !got.empty() && got.back() == end;
  }));
  std::erase(got, -2), std::erase(got, end);
  EXPECT_TRUE(std::ranges::is_sorted(got));
  EXPECT_EQ(got.front(), 0);
  EXPECT_GE(got.size(), 20u);
  EXPECT_LE(got.size() * kLarge, kKernels);
}

TEST_P(Network, PushIsRefusedOnceAllQueuesAreFullAndGoesOnWhenOneIsRead) {
  Peer pull = bed_->bound(Kind::kPull, at_, {.high_water_mark = 8});
  Peer push = bed_->connected(Kind::kPush, at_, {.high_water_mark = 8});
  const int sent = fill(push);
  EXPECT_GE(sent, 16);
  EXPECT_LE(sent * kLarge, kKernels);
  for (int i = 0; i < sent; ++i) ASSERT_EQ(number(bed_->next(pull)), i);
  EXPECT_TRUE(bed_->until([&] { return send(push, sent); }));
  EXPECT_EQ(number(bed_->next(pull)), sent);
}

// Half of the messages, until its queues are full; then all go to the other.
TEST_P(Network, PushGivesMessagesInTurnToOneThatDoesNotReadUntilItsQueuesAreFull) {
  std::string at_other;
  Peer deaf = bed_->bound(Kind::kPull, at_, {.high_water_mark = 8});
  Peer reads = bed_->bound(Kind::kPull, at_other, {.high_water_mark = 8});
  Peer push = bed_->connected(Kind::kPush, at_, {.high_water_mark = 8});
  ASSERT_TRUE(push->connect(at_other).ok());
  int sent = 0, got = 0;
  const auto pass = [&](int n, size_t bytes) {
    for (const int end = sent + n; sent < end;) {
      ASSERT_TRUE(bed_->until([&] { return send(push, sent, bytes); }));
      ++sent;
      while (reads->receive()) ++got;
    }
  };
  pass(8, sizeof(int));
  EXPECT_TRUE(bed_->until([&] { return reads->receive() && ++got == 4; }, reads.socket.get())) << got;
  EXPECT_EQ(got, 4);
  pass(2 * kKernels / kLarge, kLarge);
  EXPECT_TRUE(bed_->until(
      [&] {
        while (reads->receive()) ++got;
        return got * kLarge > kKernels;
      },
      reads.socket.get()));
  EXPECT_GE(sent - got, 16);
}

TEST_P(Network, ARouterIsToldThatAPeerIsGone) {
  Peer router = bed_->bound(Kind::kRouter, at_);
  Peer dealer = bed_->connected(Kind::kDealer, at_);
  EXPECT_FALSE(send(router, 0, 4, "unknown"));
  ASSERT_TRUE(send(dealer, 1));
  const auto asks = bed_->next(router);
  ASSERT_TRUE(asks);
  EXPECT_TRUE(send(router, 2, 4, asks->peer));
  EXPECT_EQ(number(bed_->next(dealer)), 2);
  dealer.end();
  EXPECT_TRUE(bed_->until([&] { return !send(router, 3, 4, asks->peer); }));
  EXPECT_FALSE(send(router, 4, 4, asks->peer));
}

TEST_P(Network, ARouterDropsForAPeerWhoseQueueIsFullAndServesOthers) {
  Peer router = bed_->bound(Kind::kRouter, at_, {.high_water_mark = 8});
  Peer deaf = bed_->connected(Kind::kDealer, at_, {.high_water_mark = 8});
  ASSERT_TRUE(send(deaf, 1));
  const auto asks = bed_->next(router);
  ASSERT_TRUE(asks);
  const int sent = fill(router, asks->peer);
  EXPECT_GE(sent, 16);
  EXPECT_LE(sent * kLarge, kKernels);
  Peer reads = bed_->connected(Kind::kDealer, at_);
  ASSERT_TRUE(send(reads, 2));
  const auto other = bed_->next(router);
  ASSERT_TRUE(other);
  EXPECT_NE(other->peer, asks->peer);
  EXPECT_TRUE(send(router, 3, 4, other->peer));
  EXPECT_EQ(number(bed_->next(reads)), 3);
  for (int i = 0; i < sent; ++i) ASSERT_EQ(number(bed_->next(deaf)), i);
}

TEST_P(Network, ADealerIsRefusedOnceItsQueueIsFull) {
  Peer dealer = bed_->connected(Kind::kDealer, "tcp://127.0.0.1:1", {.high_water_mark = 8, .linger_ms = 0});
  EXPECT_EQ(fill(dealer), 8);
}

// A thread that reads ahead has a queue of its own before the socket's.
TEST_P(Network, WithReadAheadTwiceAsManyWait) {
  Peer dealer =
      bed_->connected(Kind::kDealer, "tcp://127.0.0.1:1", {.high_water_mark = 8, .linger_ms = 0, .read_ahead = true});
  const int taken = fill(dealer);
  EXPECT_GE(taken, 16);
  EXPECT_LE(taken, 17);  // one that the thread tries to send is in neither queue
}

TEST_P(Network, ReadAheadTakesWhatComesUntilAThousandMessagesWait) {
  Peer pull = bed_->bound(Kind::kPull, at_, {.high_water_mark = 8, .read_ahead = true});
  Peer push = bed_->connected(Kind::kPush, at_, {.high_water_mark = 8});
  EXPECT_FALSE(pull->receive());
  const int sent = fill(push);  // messages of 64 KiB: 1024 are 64 MiB
  EXPECT_GE(sent, 1024 + 16);
  EXPECT_LE((sent - 1024) * kLarge, kKernels);
  for (int i = 0; i < sent; ++i) ASSERT_EQ(number(bed_->next(pull)), i);
}

TEST_P(Network, OrderHoldsWithinASocketAndEachIsServedInTurn) {
  Peer pull = bed_->bound(Kind::kPull, at_);
  std::vector<Peer> pushes;
  for (int p = 0; p < 3; ++p) {
    pushes.push_back(bed_->connected(Kind::kPush, at_));
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(send(pushes[p], 1000 * p + i));
  }
  std::vector<int> seen(3, 0);
  for (int n = 0; n < 300; ++n) {
    const int got = number(bed_->next(pull));
    ASSERT_GE(got, 0);
    EXPECT_EQ(got % 1000, seen[got / 1000]++);
  }
}

TEST_P(Network, WhatWasSentBeforeThePeerBoundArrives) {
  bed_->bound(Kind::kPull, at_).end();
  Peer push = bed_->connected(Kind::kPush, at_, {.watch_connecting = true});
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(send(push, i));
  ASSERT_TRUE(bed_->until([&] { return push->failed_connections() >= 2; }));
  EXPECT_FALSE(push->in_touch());
  Peer pull = bed_->bound(Kind::kPull, at_);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(number(bed_->next(pull)), i);
  EXPECT_TRUE(bed_->until([&] { return push->in_touch(); }));
}

TEST_P(Network, ABrokenConnectionIsMadeAnewAndCountsAsFailed) {
  Peer router = bed_->bound(Kind::kRouter, at_);
  Peer dealer = bed_->connected(Kind::kDealer, at_, {.watch_connecting = true});
  ASSERT_TRUE(send(dealer, 1));
  const auto before = bed_->next(router);
  ASSERT_TRUE(before);
  ASSERT_TRUE(bed_->until([&] { return dealer->in_touch(); }));
  EXPECT_EQ(dealer->failed_connections(), 0u);
  bed_->break_connections(at_);
  ASSERT_TRUE(bed_->until([&] { return dealer->failed_connections() == 1; }));
  ASSERT_TRUE(bed_->until([&] { return dealer->in_touch(); }));
  EXPECT_EQ(dealer->failed_connections(), 1u);
  ASSERT_TRUE(send(dealer, 2));
  const auto after = bed_->next(router);
  EXPECT_EQ(number(after), 2);
  EXPECT_NE(after->peer, before->peer);
  EXPECT_FALSE(send(router, 3, 4, before->peer)) << "its old name reaches no peer";
  EXPECT_TRUE(send(router, 4, 4, after->peer));
  EXPECT_EQ(number(bed_->next(dealer)), 4);
  EXPECT_EQ(router->rejected(), 0u);
}

TEST_P(Network, AConnectionThatBroughtNothingIsCounted) {
  Peer router = bed_->bound(Kind::kRouter, at_);
  Peer dealer = bed_->connected(Kind::kDealer, at_, {.watch_connecting = true});
  ASSERT_TRUE(bed_->until([&] { return dealer->in_touch(); }));
  dealer.end();
  EXPECT_TRUE(bed_->until([&] { return !router->receive() && router->rejected() == 1; }));
}

TEST_P(Network, ASubscriberMissesWhatWasPublishedWhileItWasAway) {
  Peer publisher = bed_->bound(Kind::kPub, at_);
  EXPECT_TRUE(send(publisher, 1));
  Peer subscriber = bed_->connected(Kind::kSub, at_, {.watch_connecting = true});
  subscribe(publisher, subscriber);
  ASSERT_TRUE(send(publisher, 2));
  ASSERT_EQ(numbers_until(subscriber, 2).back(), 2);
  bed_->break_connections(at_);
  ASSERT_TRUE(bed_->until([&] { return subscriber->failed_connections() == 1; }));
  ASSERT_TRUE(send(publisher, 3));
  subscribe(publisher, subscriber);
  ASSERT_TRUE(send(publisher, 4));
  const std::vector<int> after = numbers_until(subscriber, 4);
  EXPECT_EQ(after.back(), 4);
  EXPECT_EQ(std::ranges::count(after, 3), 0);
}

// Messages on the wire or at the other end are lost; those that still waited go over the next connection.
TEST_P(Network, WhatStillWaitsAtTheSideThatConnectsOutlivesTheConnection) {
  Peer pull = bed_->bound(Kind::kPull, at_, {.high_water_mark = 8});
  Peer push = bed_->connected(Kind::kPush, at_, {.high_water_mark = 8});
  const int sent = fill(push);
  EXPECT_EQ(number(bed_->next(pull)), 0);
  pull.end();
  pull = bed_->bound(Kind::kPull, at_, {.high_water_mark = 8});
  const std::vector<int> got = numbers_until(pull, sent - 1);
  EXPECT_EQ(got.back(), sent - 1);
  EXPECT_GT(got.front(), 8);
  EXPECT_GE(got.size(), 3u) << "the sender learns in steps of half its mark what was taken";
  for (size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i], got.front() + int(i)) << "no gap, none twice";
}

// The side that accepts forgets what it had for a connection.
TEST_P(Network, WhatWaitsAtTheSideThatAcceptsIsLostWithTheConnection) {
  Peer router = bed_->bound(Kind::kRouter, at_, {.high_water_mark = 100});
  Peer dealer = bed_->connected(Kind::kDealer, at_, {.high_water_mark = 8});
  ASSERT_TRUE(send(dealer, 1));
  const auto asks = bed_->next(router);
  ASSERT_TRUE(asks);
  const int sent = fill(router, asks->peer);
  EXPECT_GE(sent, 108);
  bed_->break_connections(at_);
  ASSERT_TRUE(bed_->until([&] { return !send(router, sent, 4, asks->peer); }));
  std::vector<int> got;
  std::optional<Message> again;
  ASSERT_TRUE(bed_->until([&] {
    while (const auto m = dealer->receive()) got.push_back(number(m));
    send(dealer, 2);
    return (again = router->receive()).has_value();
  })) << "the dealer learns of it once it has read what came before";
  const int end = 100000;
  ASSERT_TRUE(send(router, end, 4, again->peer));
  for (const int n : numbers_until(dealer, end)) got.push_back(n);
  EXPECT_EQ(got.back(), end);
  EXPECT_GE(got.size(), 9u) << "what had come is still read";
  EXPECT_LT(int(got.size()), sent - 40);
  for (size_t i = 0; i + 1 < got.size(); ++i) EXPECT_EQ(got[i], int(i));
}

TEST_P(Network, OversizedMessagesAreDroppedAndCounted) {
  Peer pull = bed_->bound(Kind::kPull, at_, {.max_message_bytes = 1000});
  Peer push = bed_->connected(Kind::kPush, at_);
  ASSERT_TRUE(send(push, 1, 1000));
  ASSERT_TRUE(send(push, 2, 1001));
  ASSERT_TRUE(send(push, 3, 1000));
  EXPECT_EQ(number(bed_->next(pull)), 1);
  EXPECT_EQ(number(bed_->next(pull)), 3);
  EXPECT_EQ(pull->rejected(), 1u);
}

TEST_P(Network, AMessageMuchTooLargeEndsItsConnection) {
  Peer router = bed_->bound(Kind::kRouter, at_, {.max_message_bytes = 1000});
  Peer dealer = bed_->connected(Kind::kDealer, at_, {.watch_connecting = true});
  ASSERT_TRUE(send(dealer, 1));
  EXPECT_EQ(number(bed_->next(router)), 1);
  ASSERT_TRUE(send(dealer, 2, (16u << 20) + 1001));
  ASSERT_TRUE(bed_->until([&] { return dealer->failed_connections() > 0; }, router.socket.get()));
  ASSERT_TRUE(send(dealer, 3));
  EXPECT_EQ(number(bed_->next(router)), 3);
}

TEST_P(Network, WhatWasSentLingersUntilItIsTaken) {
  Peer pull = bed_->bound(Kind::kPull, at_);
  {
    Peer push = bed_->connected(Kind::kPush, at_, {.linger_ms = 20000});
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(send(push, i));
  }
  for (int i = 0; i < 20; ++i) EXPECT_EQ(number(bed_->next(pull)), i);
}

TEST_P(Network, WhatARouterAnsweredLastLingersToo) {
  Peer router = bed_->bound(Kind::kRouter, at_);
  Peer dealer = bed_->connected(Kind::kDealer, at_);
  ASSERT_TRUE(send(dealer, 1));
  const auto asks = bed_->next(router);
  ASSERT_TRUE(asks);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(send(router, i, kLarge, asks->peer));
  router.end();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(number(bed_->next(dealer)), i);
}

TEST_P(Network, WithoutLingerNothingIsSentAfterTheEnd) {
  bed_->bound(Kind::kPull, at_).end();
  {
    Peer push = bed_->connected(Kind::kPush, at_, {.linger_ms = 0});
    ASSERT_TRUE(send(push, 1));
  }
  Peer pull = bed_->bound(Kind::kPull, at_);
  Peer other = bed_->connected(Kind::kPush, at_);
  ASSERT_TRUE(send(other, 2));
  EXPECT_EQ(number(bed_->next(pull)), 2);
  EXPECT_FALSE(pull->receive());
}

TEST_P(Network, ConnectionsBeyondTheLimitAreRefusedUntilThereIsRoom) {
  Peer router = bed_->bound(Kind::kRouter, at_, {.most_connections = 1});
  Peer first = bed_->connected(Kind::kDealer, at_);
  ASSERT_TRUE(send(first, 1));
  EXPECT_EQ(number(bed_->next(router)), 1);
  Peer second = bed_->connected(Kind::kDealer, at_, {.watch_connecting = true});
  ASSERT_TRUE(send(second, 2));
  ASSERT_TRUE(bed_->until([&] { return !router->receive() && router->connections_refused() > 0; }));
  EXPECT_EQ(router->rejected(), 0u);
  first.end();
  EXPECT_TRUE(bed_->until([&] {  // what it says over a connection that is refused then may be lost
    send(second, 2);
    return number(router->receive()) == 2;
  }));
}

TEST_P(Network, BytesThatWaitForARoutersPeerAreLimited) {
  constexpr uint64_t kMost = 1 << 20;
  Peer router = bed_->bound(Kind::kRouter, at_, {.high_water_mark = 10000, .most_queued_bytes = kMost});
  Peer deaf = bed_->connected(Kind::kDealer, at_, {.high_water_mark = 8});
  ASSERT_TRUE(send(deaf, 1));
  const auto asks = bed_->next(router);
  ASSERT_TRUE(asks);
  const int sent = fill(router, asks->peer);
  EXPECT_GE(sent * kLarge, kMost);
  EXPECT_LE(sent * kLarge, kMost + kKernels);
  EXPECT_GE(router->queue_refused(), 80u);
  EXPECT_GE(router->queued_bytes(asks->peer), kMost - kLarge);
  EXPECT_LE(router->queued_bytes(asks->peer), kMost);
}

TEST_P(Network, ASubscriberWhoDoesNotReadIsHungUpOnForItsBytes) {
  constexpr uint64_t kMost = 4 << 20;
  Peer publisher = bed_->bound(Kind::kPub, at_, {.high_water_mark = 100000, .most_queued_bytes = kMost});
  Peer deaf = bed_->connected(Kind::kSub, at_, {.high_water_mark = 8, .watch_connecting = true});
  subscribe(publisher, deaf);
  const uint64_t failed = deaf->failed_connections();
  for (size_t i = 0; i < 2 * kKernels / kLarge && publisher->queue_refused() == 0; ++i) {
    ASSERT_TRUE(send(publisher, int(i), kLarge));
    bed_->wait(nullptr);
  }
  EXPECT_EQ(publisher->queue_refused(), 1u);
  EXPECT_TRUE(bed_->until([&] {
    while (deaf->receive()) {
    }
    return deaf->failed_connections() > failed;
  }));
}

TEST_P(Network, WhoSendsMoreThanIsReadIsHungUpOn) {
  Peer pull = bed_->bound(Kind::kPull, at_, {.high_water_mark = 1000, .most_unread_bytes = 8 << 20});
  Peer push = bed_->connected(Kind::kPush, at_, {.high_water_mark = 1000, .watch_connecting = true});
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(send(push, i, kLarge));
  EXPECT_TRUE(bed_->until([&] { return pull->connections_refused() > 0; }));
  // Whole messages are not lost; messages sent over the next connection come beside them.
  std::vector<int> got = numbers_until(pull, 63);
  std::erase_if(got, [](int n) { return n > 63; });
  ASSERT_EQ(got.size(), 64u);
  for (int i = 0; i < 64; ++i) EXPECT_EQ(got[i], i);
}

// Real processes, which are forked, beside simulated ones.

class Child {
 public:
  /// run(out, in): in the child; it ends when it is killed.
  explicit Child(const std::function<void(int out, int in)>& run) {
    EXPECT_EQ(pipe(from_) + pipe(to_), 0);
    id_ = fork();
    if (id_ != 0) return;
    run(from_[1], to_[0]);
    for (;;) pause();
  }
  ~Child() {
    end();
    for (const int fd : {from_[0], from_[1], to_[0], to_[1]}) close(fd);
  }
  void tell(const std::string& text) const { EXPECT_GT(write(to_[1], text.c_str(), text.size() + 1), 0); }
  std::string hear() const { return hear(from_[0]); }
  void stop() const {
    kill(id_, SIGSTOP);
    waitpid(id_, nullptr, WUNTRACED);
  }
  void end() {
    if (id_ <= 0) return;
    kill(id_, SIGKILL);
    waitpid(std::exchange(id_, 0), nullptr, 0);
  }
  static std::string hear(int fd) {
    char text[100] = {};
    return read(fd, text, sizeof text - 1) > 0 ? text : "";
  }

 private:
  int from_[2], to_[2];
  pid_t id_ = 0;
};

const SocketOptions kSmallQueue{.high_water_mark = 8, .linger_ms = 0, .watch_connecting = true};

// A process that stands still is given messages as long as its kernel and queues take any.
TEST(StoppedProcess, IsStillGivenMessages) {
  const Child child([](int out, int) {
    net::Context context;
    net::Socket pull(context, Kind::kPull, "stopped", kSmallQueue);
    const auto bound = pull.bind("tcp://127.0.0.1:*");
    if (!bound || write(out, bound->c_str(), bound->size() + 1) < 0) _exit(1);
    pause();
  });
  {
    net::Context context;
    net::Socket push(context, Kind::kPush, "sends", kSmallQueue);
    ASSERT_TRUE(push.connect(child.hear()).ok());
    while (!push.in_touch()) net::wait_readable({}, 5);
    child.stop();
    for (int i = 0; i < 16; ++i)
      while (!push.send_frames({}, "x", std::string(1000, 'x'))) net::wait_readable({}, 5);
    EXPECT_TRUE(push.in_touch());
  }
  SimulatedNetwork network(1);
  net::Context receiver(network.attach(0)), sender(network.attach(1));
  net::Socket pull(receiver, Kind::kPull, "stopped", kSmallQueue), push(sender, Kind::kPush, "sends", kSmallQueue);
  ASSERT_TRUE(push.connect(*pull.bind("tcp://127.0.0.1:*")).ok());
  network.advance(1);
  network.stop(0);
  for (int i = 0; i < 16; ++i) EXPECT_TRUE(push.send_frames({}, "x", std::string(1000, 'x'))) << i;
  network.advance(2);
  EXPECT_FALSE(pull.receive());
  EXPECT_TRUE(push.in_touch());
  network.go_on(0);
  for (int i = 0; i < 16; ++i) EXPECT_TRUE(pull.receive()) << i;
}

// Returns the number of messages of 64 KiB that are taken before one is refused for good.
int fill_up(net::Socket& push, const std::function<void()>& wait) {
  int sent = 0;
  for (int refused = 0; refused < 80;)
    push.send_frames({}, "x", std::string(kLarge, 'x')) ? (++sent, refused = 0) : (++refused, wait(), 0);
  return sent;
}

// Messages in its kernel, and those that had come, are still read; those in its own queue are lost.
TEST(KilledProcess, WhatItsKernelHadArrives) {
  Child child([](int out, int in) {
    net::Context context;
    net::Socket push(context, Kind::kPush, "killed", kSmallQueue);
    if (!push.connect(Child::hear(in))) _exit(1);
    const std::string sent = std::to_string(fill_up(push, [] { net::wait_readable({}, 5); }));
    if (write(out, sent.c_str(), sent.size() + 1) < 0) _exit(1);
    pause();
  });
  const auto count = [](net::Socket& pull, const std::function<void()>& wait) {
    int got = 0;
    for (int idle = 0; idle < 40;) pull.receive() ? (++got, idle = 0) : (++idle, wait(), 0);
    return got;
  };
  {
    net::Context context;
    net::Socket pull(context, Kind::kPull, "reads", kSmallQueue);
    child.tell(*pull.bind("tcp://127.0.0.1:*"));
    const int sent = std::stoi(child.hear());
    child.end();
    const int got = count(pull, [] { net::wait_readable({}, 5); });
    EXPECT_GE(got, sent - 10);
    EXPECT_LE(got, sent - 3);
  }
  SimulatedNetwork network(1);
  net::Context receiver(network.attach(0)), sender(network.attach(1));
  net::Socket pull(receiver, Kind::kPull, "reads", kSmallQueue), push(sender, Kind::kPush, "killed", kSmallQueue);
  ASSERT_TRUE(push.connect(*pull.bind("tcp://127.0.0.1:*")).ok());
  const auto wait = [&] { network.advance(network.now_s() + 0.005); };
  const int sent = fill_up(push, wait);
  network.crash(1);
  network.advance(network.now_s() + 1);
  const int got = count(pull, wait);
  EXPECT_GE(got, sent - 10);
  EXPECT_LE(got, sent - 3);
}

}  // namespace
}  // namespace telesplat::simulation
