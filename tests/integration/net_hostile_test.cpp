// Sockets and peers that misbehave: bad messages are dropped and counted, all other peers are served.
#include <gtest/gtest.h>

#include <pthread.h>

#include <atomic>
#include <csignal>
#include <mutex>
#include <random>
#include <thread>

#include "common/core/clock.h"
#include "common/net/connections/monitor.h"
#include "common/net/dispatch.h"
#include "common/net/service.h"
#include "tests/integration/receive.h"
#include "tests/support/patience.h"
#include "tests/support/raw_peer.h"

namespace telesplat::net {
namespace {

using test::RawPeer;
using test::receive_until;
using test::zmtp_claim;
using test::zmtp_frame;
using test::zmtp_opening;

struct Bound {
  Bound(Kind kind, const SocketOptions& options = {}) : socket(context, kind, "bound", options) {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound.ok());
    endpoint = bound->c_str();
  }
  bool rejects(uint64_t n) {
    return receive_until(socket, [&] { return socket.rejected() >= n; });
  }

  Context context;
  Socket socket;
  std::string endpoint;
};

const wire::Goodbye kGoodbye{InstanceId{7}};

// Checks that a friend's message arrives in spite of others.
void expect_served(Bound& bound) {
  Context context;
  Socket friendly(context, Kind::kDealer, "friend");
  ASSERT_TRUE(friendly.connect(bound.endpoint).ok());
  ASSERT_TRUE(friendly.send(kGoodbye));
  std::vector<Message> got;
  EXPECT_TRUE(receive_until(
      bound.socket, [&] { return !got.empty(); }, &got));
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.back().type, wire::Goodbye::kName);
}

// A peer fills the queue, so that ZeroMQ reads no more from it; then the connection breaks, and the queue stays unread.
// ZeroMQ 4.3 ends the process when a heartbeat is due over such a connection (libzmq/issues/4841): our sockets have no
// heartbeats.
TEST(HostilePeers, SocketsHaveNoHeartbeats) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::pull);
  socket.set(zmq::sockopt::heartbeat_ivl, 2000);
  look_after(socket, 10);
  EXPECT_EQ(socket.get(zmq::sockopt::heartbeat_ivl), 0);
}

TEST(HostilePeers, WhoSendsTooMuchAndBreaksOffWhileNobodyReadsEndsNobody) {
  Bound bound(Kind::kPull, {.high_water_mark = 4, .max_message_bytes = 100000});
  RawPeer peer(bound.endpoint);
  ASSERT_TRUE(peer.shake_hands("PUSH"));
  const std::string message = zmtp_frame("goodbye", true) + zmtp_frame(std::string(60000, 'x'), false);
  ASSERT_GT(peer.send_until_full(message, 500), 4u);
  peer.reset();
  RawPeer later(bound.endpoint);
  ASSERT_TRUE(later.shake_hands("PUSH")) << "by then ZeroMQ's thread knows of the break";
  std::vector<Message> got;
  EXPECT_TRUE(receive_until(
      bound.socket, [&] { return got.size() >= 4; }, &got));
  Context context;
  Socket friendly(context, Kind::kPush, "friend");
  ASSERT_TRUE(friendly.connect(bound.endpoint).ok());
  ASSERT_TRUE(friendly.send(kGoodbye));
  EXPECT_TRUE(receive_until(
      bound.socket, [&] { return !got.empty() && got.back().body.size() < 1000; }, &got));
}

TEST(HostilePeers, FrameCountsAndSizesAreLimited) {
  Bound bound(Kind::kRouter, {.max_message_bytes = 1000});
  RawPeer peer(bound.endpoint);
  ASSERT_TRUE(peer.shake_hands("DEALER"));
  peer.send(zmtp_frame("goodbye", false));  // no body
  ASSERT_TRUE(bound.rejects(1));
  for (int i = 0; i < 9; ++i) peer.send(zmtp_frame("x", true));
  peer.send(zmtp_frame("x", false));  // ten frames
  ASSERT_TRUE(bound.rejects(2));
  peer.send(zmtp_frame("goodbye", true) + zmtp_frame(std::string(1001, 'x'), false));  // one byte too many
  ASSERT_TRUE(bound.rejects(3));
  peer.send(zmtp_frame("", true) + zmtp_frame("", false));  // an empty type and body: complete, but of no known type
  std::vector<Message> got;
  ASSERT_TRUE(receive_until(
      bound.socket, [&] { return !got.empty(); }, &got));
  dispatch<wire::Goodbye>(bound.socket, got[0], [](const auto&) { FAIL(); });
  EXPECT_EQ(bound.socket.rejected(), 4u);
  expect_served(bound);
  EXPECT_EQ(bound.socket.rejected(), 4u);
}

TEST(HostilePeers, UnknownTypesWrongVersionsAndBadBodiesAreCounted) {
  Bound bound(Kind::kRouter);
  Context context;
  Socket peer(context, Kind::kDealer, "peer");
  ASSERT_TRUE(peer.connect(bound.endpoint).ok());
  std::string other_version = wire::encode(kGoodbye);
  const size_t v = other_version.find("\xa1v") + 2;
  ASSERT_EQ(other_version[v], char(wire::kProtocolVersion));
  other_version[v] = char(wire::kProtocolVersion + 1);
  peer.send_frames({}, "no_such_type", wire::encode(kGoodbye));
  peer.send_frames({}, std::string(5000, 't'), wire::encode(kGoodbye));
  peer.send_frames({}, wire::Goodbye::kName, other_version);
  peer.send_frames({}, wire::Goodbye::kName, wire::encode(kGoodbye).substr(0, 5));
  peer.send_frames({}, wire::Goodbye::kName, "");
  peer.send(kGoodbye);
  int served = 0;
  std::vector<Message> got;
  ASSERT_TRUE(receive_until(
      bound.socket, [&] { return got.size() == 6; }, &got));
  for (const auto& m : got)
    dispatch<wire::Goodbye>(bound.socket, m,
                            [&](const wire::Goodbye& g) { served += g.instance == kGoodbye.instance; });
  EXPECT_EQ(served, 1);
  EXPECT_EQ(bound.socket.rejected(), 5u);
}

// Input that a binding socket of any kind must survive and count.
class RawBytes : public ::testing::TestWithParam<Kind> {
 protected:
  static const char* friends_type() {
    return GetParam() == Kind::kRouter ? "DEALER" : GetParam() == Kind::kPull ? "PUSH" : "SUB";
  }
};

TEST_P(RawBytes, RandomBytesAreCountedOnceAConnection) {
  Bound bound(GetParam());
  std::mt19937 random(1);
  for (uint64_t n = 1; n <= 40; ++n) {
    std::string bytes(1 + random() % 300, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    if (n % 4 == 0) bytes[0] = '\xff';  // looks like a later protocol
    if (n % 4 == 1)
      bytes[0] = 1, bytes.resize(std::max<size_t>(bytes.size(), 2)), bytes[1] = 0;  // an empty ZMTP 1.0 routing id
    const uint64_t before = bound.socket.rejected();
    {
      RawPeer peer(bound.endpoint);
      ASSERT_TRUE(peer.connected());
      peer.send(bytes);
    }
    ASSERT_TRUE(bound.rejects(before + 1)) << "connection " << n;
  }
}

TEST_P(RawBytes, OtherProtocolsAndSilenceAreCounted) {
  Bound bound(GetParam());
  uint64_t n = 0;
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11), std::string(), std::string(100000, '\0'),
        std::string(100000, '\xff'), zmtp_opening("REQ"), zmtp_opening("DEALER").substr(0, 70)}) {
    {
      RawPeer peer(bound.endpoint);
      peer.send(bytes);
    }
    ASSERT_TRUE(bound.rejects(++n)) << "after " << n << " connections";
  }
}

TEST_P(RawBytes, ClaimsOfHugeFramesAllocateNothingAndAreCounted) {
  Bound bound(GetParam());
  const double before_mb = resident_mb();
  uint64_t n = 0;
  for (const uint64_t claim :
       {uint64_t(1) << 62, ~uint64_t(0), uint64_t(1) << 40, uint64_t(1) << 31, uint64_t(100) << 20}) {
    RawPeer peer(bound.endpoint);
    ASSERT_TRUE(peer.shake_hands(friends_type()));
    peer.send(zmtp_claim(claim) + "abc");
    EXPECT_TRUE(peer.wait_hung_up(20000)) << "claim of " << claim << " bytes";
    ASSERT_TRUE(bound.rejects(++n)) << "claim of " << claim << " bytes";
  }
  EXPECT_LT(resident_mb() - before_mb, 64);
}

INSTANTIATE_TEST_SUITE_P(Kinds, RawBytes, ::testing::Values(Kind::kRouter, Kind::kPull, Kind::kPub),
                         [](const auto& info) {
                           return info.param == Kind::kRouter ? "Router" : info.param == Kind::kPull ? "Pull" : "Pub";
                         });

// ZeroMQ keeps each subscriber's wishes, and one may have millions.
TEST(HostilePeers, StrangeSubscriptionsAreCountedAndHungUpOn) {
  Bound bound(Kind::kPub);
  uint64_t n = 0;
  for (const std::string& wish : {std::string("\x01patch"), std::string("hello"), std::string(3000, '\x01')}) {
    RawPeer peer(bound.endpoint);
    ASSERT_TRUE(peer.shake_hands("SUB"));
    peer.send(zmtp_frame(wish, false));
    EXPECT_TRUE(bound.rejects(++n));
    EXPECT_TRUE(peer.wait_hung_up(20000)) << "wish " << n;
    EXPECT_EQ(bound.socket.connections_refused(), n);
  }
}

TEST(HostilePeers, FriendsWhoComeAndGoAreNotCounted) {
  Bound router(Kind::kRouter), pull(Kind::kPull), pub(Kind::kPub);
  for (int i = 0; i < 5; ++i) {
    Context context;
    Socket dealer(context, Kind::kDealer, "dealer"), push(context, Kind::kPush, "push"),
        sub(context, Kind::kSub, "sub");
    ASSERT_TRUE(dealer.connect(router.endpoint).ok() && push.connect(pull.endpoint).ok() &&
                sub.connect(pub.endpoint).ok());
    dealer.send(kGoodbye);
    push.send(kGoodbye);
    std::vector<Message> a, b, c;
    ASSERT_TRUE(receive_until(
        router.socket, [&] { return !a.empty(); }, &a));
    ASSERT_TRUE(receive_until(
        pull.socket, [&] { return !b.empty(); }, &b));
    ASSERT_TRUE(receive_until(
        sub, [&] { return pub.socket.send(kGoodbye), !c.empty(); }, &c));
  }
  // Their ends are reported in order: the first that counts is a stranger's after theirs.
  for (Bound* b : {&router, &pull, &pub}) {
    { RawPeer stranger(b->endpoint); }
    ASSERT_TRUE(b->rejects(1));
    EXPECT_EQ(b->socket.rejected(), 1u);
  }
}

TEST(HostilePeers, AFloodFromOneLeavesRoomForOthers) {
  Bound bound(Kind::kRouter, {.high_water_mark = 100, .max_message_bytes = 1000});
  std::atomic<bool> stop{false}, stopped{false};
  std::thread flood([&] {
    RawPeer peer(bound.endpoint);
    peer.shake_hands("DEALER");
    std::string batch;
    for (int i = 0; i < 1000; ++i) batch += zmtp_frame("goodbye", false);
    while (!stop && peer.send(batch)) {
    }
    stopped = true;
  });
  EXPECT_TRUE(bound.rejects(1000));
  Context context;
  Socket friendly(context, Kind::kDealer, "friend");
  EXPECT_TRUE(friendly.connect(bound.endpoint).ok());
  for (int i = 0; i < 20; ++i) {
    friendly.send(kGoodbye);
    std::vector<Message> got, answer;
    EXPECT_TRUE(receive_until(
        bound.socket, [&] { return !got.empty(); }, &got))
        << "message " << i;
    if (got.empty()) break;
    EXPECT_TRUE(bound.socket.send(wire::Shutdown{"thanks"}, got[0].peer));
    EXPECT_TRUE(receive_until(
        friendly, [&] { return !answer.empty(); }, &answer));
  }
  stop = true;
  EXPECT_TRUE(
      receive_until(bound.socket, [&] { return stopped.load(); }));  // the sender may be waiting for room in its socket
  flood.join();
}

TEST(HostilePeers, BytesThatTrickleInMakeAMessage) {
  Bound bound(Kind::kRouter);
  RawPeer peer(bound.endpoint);
  for (const char c : zmtp_opening("DEALER")) ASSERT_TRUE(peer.send({&c, 1}));
  ASSERT_TRUE(peer.wait_ready());
  for (const char c : zmtp_frame("goodbye", true) + zmtp_frame(wire::encode(kGoodbye), false))
    ASSERT_TRUE(peer.send({&c, 1}));
  std::vector<Message> got;
  ASSERT_TRUE(receive_until(
      bound.socket, [&] { return !got.empty(); }, &got));
  EXPECT_TRUE(bound.socket.decode<wire::Goodbye>(got[0]));
  EXPECT_EQ(bound.socket.rejected(), 0u);
}

// A signal may come between two parts of a message, on either side.
TEST(HostilePeers, SignalsDoNotTearMessages) {
  struct sigaction quiet = {}, before = {};
  quiet.sa_handler = [](int) {};  // without SA_RESTART: calls are interrupted
  sigaction(SIGUSR1, &quiet, &before);
  constexpr int kMessages = 100000;
  Bound bound(Kind::kRouter, {.high_water_mark = 1000});
  std::atomic<bool> stop{false};
  const pthread_t receiver = pthread_self();
  std::thread sender([&] {
    Context context;
    Socket socket(context, Kind::kDealer, "sender", {.high_water_mark = 1000});
    EXPECT_TRUE(socket.connect(bound.endpoint).ok());
    for (int i = 0; i < kMessages && !stop;)
      if (socket.send(kGoodbye))
        ++i;
      else
        std::this_thread::yield();
    while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  std::thread signaller([&, sends = sender.native_handle()] {
    while (!stop) {
      pthread_kill(receiver, SIGUSR1);
      pthread_kill(sends, SIGUSR1);
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  int got = 0;
  for (const double until = monotonic_s() + 60; got < kMessages && monotonic_s() < until;
       wait_readable({&bound.socket}, 5))
    while (const auto m = bound.socket.receive()) got += m->type == wire::Goodbye::kName;
  stop = true;
  signaller.join();
  sender.join();
  sigaction(SIGUSR1, &before, nullptr);
  EXPECT_EQ(got, kMessages);
  EXPECT_EQ(bound.socket.rejected(), 0u);
}

// ZeroMQ's thread reports connections; it must not wait for a socket that is about to end, or that is not read.
TEST(HostilePeers, SocketsEndWhilePeersComeAndGo) {
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::string endpoint;
  std::vector<std::thread> peers;
  for (int i = 0; i < 4; ++i)
    peers.emplace_back([&] {
      while (!stop) {
        std::string to;
        {
          const std::lock_guard lock(mutex);
          to = endpoint;
        }
        if (!to.empty()) RawPeer(to).send("x");
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    });
  std::atomic<int> ended{0};
  std::thread sockets([&] {
    for (; ended < 200 && !stop; ++ended) {
      Bound bound(Kind::kRouter);
      const std::lock_guard lock(mutex);
      endpoint = bound.endpoint;
    }
  });
  for (const double until = monotonic_s() + 60; ended < 200 && monotonic_s() < until;)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(ended, 200) << "one did not end";
  stop = true;
  sockets.join();
  for (auto& peer : peers) peer.join();
}

TEST(HostilePeers, ASocketThatNobodyReadsTakesConnections) {
  Bound bound(Kind::kRouter);
  for (int i = 0; i < 6000; ++i) RawPeer(bound.endpoint).send("x");
  Context context;
  Socket friendly(context, Kind::kDealer, "friend");
  ASSERT_TRUE(friendly.connect(bound.endpoint).ok());
  ASSERT_TRUE(friendly.send(kGoodbye));
  EXPECT_TRUE(wait_readable({&bound.socket}, 10000));
}

}  // namespace
}  // namespace telesplat::net
