// Bytes that have arrived and wait unread: a peer that sends without end, or more than is read, is closed, and other
// peers are not. ZeroMQ's own limits count whole messages.
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "common/core/clock.h"
#include "common/net/connections/connections.h"
#include "common/net/socket.h"
#include "common/wire/messages.h"
#include "tests/integration/receive.h"
#include "tests/support/keys/key_folder.h"
#include "tests/support/patience.h"
#include "tests/support/raw_peer.h"

namespace telesplat::net {
namespace {

using test::KeyFolder;
using test::RawPeer;
using test::zmtp_frame;

constexpr double kDeadline_s = test::patient(20);
constexpr uint64_t kMiB = 1 << 20;

struct Bound {
  Bound(Kind kind, SocketOptions options, Access access = {})
      : context(std::move(access)), socket(context, kind, "bound", options) {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound.ok()) << (bound ? "" : bound.error().text);
    if (bound) endpoint = *bound;
  }
  template <class Done>
  bool receive_until(Done done, std::vector<Message>* got = nullptr) {
    return test::receive_until(socket, done, got);
  }
  bool serves_a_friend(Kind kind) {
    Context theirs;
    Socket friendly(theirs, kind, "friend");
    std::vector<Message> got;
    return friendly.connect(endpoint).ok() && friendly.send(wire::Goodbye{InstanceId{7}}) &&
           receive_until([&] { return !got.empty() && got.back().type == wire::Goodbye::kName; }, &got);
  }

  Context context;
  Socket socket;
  std::string endpoint;
};

// Sends `bytes` again and again until the other side hangs up.
class Flood {
 public:
  Flood(const std::string& endpoint, std::string_view type, std::string bytes)
      : thread_([this, endpoint, type, bytes = std::move(bytes)] {
          RawPeer peer(endpoint);
          if (!peer.shake_hands(type)) return;
          while (!stop_ && peer.send(bytes)) sent_ += bytes.size();
          ended_ = true;
        }) {}
  ~Flood() {
    stop_ = true;
    thread_.join();
  }
  bool hung_up_on() const { return ended_; }
  uint64_t sent() const { return sent_; }

 private:
  std::atomic<bool> stop_ = false, ended_ = false;
  std::atomic<uint64_t> sent_ = 0;
  std::thread thread_;
};

std::string parts(size_t bytes_of_one, size_t n) {
  std::string out;
  for (size_t i = 0; i < n; ++i) out += zmtp_frame(std::string(bytes_of_one, 'x'), true);
  return out;
}

class MessageWithoutEnd : public ::testing::TestWithParam<size_t> {};

// On a fast machine many bytes may come between two looks; the test is that there is a limit.
TEST_P(MessageWithoutEnd, IsCutOff) {
  Bound bound(Kind::kRouter, {.max_message_bytes = kMiB, .most_unread_bytes = 8 * kMiB});
  const Flood flood(bound.endpoint, "DEALER", parts(GetParam(), 100000 / (GetParam() + 2) + 1));
  EXPECT_TRUE(bound.receive_until([&] { return flood.hung_up_on(); })) << flood.sent() << " bytes";
  EXPECT_GT(flood.sent(), 4 * kMiB);
  EXPECT_EQ(bound.socket.connections_refused(), 1u);
  EXPECT_TRUE(bound.serves_a_friend(Kind::kDealer));
}

INSTANTIATE_TEST_SUITE_P(PartsOfBytes, MessageWithoutEnd, ::testing::Values(0, 1000, 500000),
                         [](const auto& info) { return std::to_string(info.param); });

TEST(HostilePeers, WhoeverFillsAQueueWithLargeMessagesIsHungUpOn) {
  Bound bound(Kind::kPull, {.high_water_mark = 1000, .max_message_bytes = kMiB, .most_unread_bytes = 16 * kMiB});
  {
    const Flood flood(bound.endpoint, "PUSH", zmtp_frame("rubbish", true) + zmtp_frame(std::string(kMiB, 'x'), false));
    for (const double until = monotonic_s() + kDeadline_s; !flood.hung_up_on() && monotonic_s() < until;)
      wait_readable({}, 5);  // the messages stay unread
    EXPECT_TRUE(flood.hung_up_on()) << flood.sent() << " bytes";
  }
  EXPECT_EQ(bound.socket.connections_refused(), 1u);
  std::vector<Message> got;
  EXPECT_TRUE(bound.receive_until([&] { return got.size() >= 8; }, &got)) << "what was whole is not lost";
  EXPECT_TRUE(bound.serves_a_friend(Kind::kPush));
}

// The system reuses a connection's number, also after one that sent no message.
TEST(Connections, TheFirstMessageOfAReusedDescriptorIsOfTheOneThatIsThere) {
  constexpr uint64_t kMessage = 4 * kMiB;
  zmq::context_t context;
  zmq::socket_t router(context, zmq::socket_type::router);
  Connections connections(context, router, {.name = "router", .most_unread = kMessage + kMiB});
  router.bind("tcp://127.0.0.1:*");
  const std::string endpoint = router.get(zmq::sockopt::last_endpoint);
  const auto wait_open = [&](size_t most) {
    for (const double until = monotonic_s() + kDeadline_s; connections.counts().open != most;) {
      if (monotonic_s() > until) return false;
      zmq::pollitem_t item{nullptr, connections.descriptor(), ZMQ_POLLIN, 0};
      zmq::poll(&item, 1, std::chrono::milliseconds(10));
    }
    return true;
  };
  const auto wait_message = [&] {
    zmq::pollitem_t item{router.handle(), 0, ZMQ_POLLIN, 0};
    return zmq::poll(&item, 1, std::chrono::milliseconds(int(kDeadline_s * 1e3))) == 1;
  };
  // Returns the connection of the next message.
  const auto receive = [&] {
    zmq::message_t peer, body;
    if (!wait_message() || !router.recv(peer) || !router.recv(body)) return -1;
    const int fd = zmq_msg_get(body.handle(), ZMQ_SRCFD);
    connections.spoke(fd, body.size());
    return fd;
  };
  int first = -1;
  {
    RawPeer speaks(endpoint);
    ASSERT_TRUE(speaks.shake_hands("DEALER") && speaks.send(zmtp_frame("hello", false)));
    first = receive();
  }
  ASSERT_TRUE(wait_open(0));
  {
    const RawPeer says_nothing(endpoint);
    ASSERT_TRUE(wait_open(1));
  }
  ASSERT_TRUE(wait_open(0));
  RawPeer speaks(endpoint);
  const std::string message = zmtp_frame(std::string(kMessage, 'x'), false);
  ASSERT_TRUE(speaks.shake_hands("DEALER") && speaks.send(message));
  ASSERT_EQ(receive(), first) << "the number is used again";
  ASSERT_TRUE(speaks.send(message) && wait_message());
  connections.hang_up_on_unread();
  EXPECT_EQ(connections.counts().refused, 0u) << "of two messages one was read";
}

// Twenty thousand messages of all lengths: an error of one byte a message in the count would add up.
void expect_kept(Bound& bound, Access access) {
  Context theirs(std::move(access));
  Socket friendly(theirs, Kind::kDealer, "friend");
  ASSERT_TRUE(friendly.connect(bound.endpoint).ok());
  std::vector<Message> got;
  for (size_t sent = 0; sent < 20000;) {
    for (int i = 0; i < 100; ++i, ++sent)
      ASSERT_TRUE(friendly.send_frames({}, wire::Goodbye::kName, std::string(sent % 700, 'x')));
    got.clear();
    ASSERT_TRUE(bound.receive_until([&] { return got.size() >= 100; }, &got)) << sent;
    if (sent % 2000 == 0) wait_readable({}, 60);  // longer than the time between two looks
  }
  EXPECT_EQ(bound.socket.connections_refused(), 0u);
}

constexpr uint64_t kHundredMessages = 100000;

TEST(HostilePeers, WhoIsReadIsKeptHoweverMuchItSends) {
  Bound bound(Kind::kRouter, {.most_unread_bytes = kHundredMessages});
  expect_kept(bound, {});
}

TEST(Keys, WhoIsReadIsKeptHoweverMuchItSends) {
  const KeyFolder keys;
  Bound bound(Kind::kRouter, {.serves = "control", .most_unread_bytes = kHundredMessages}, keys.server());
  expect_kept(bound, keys.of(Role::kSampler));
}

}  // namespace
}  // namespace telesplat::net
