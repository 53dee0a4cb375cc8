// Limits of a socket's connections, with keys and without: connections beyond the limit are refused and counted, silent
// peers are closed, and friends stay.
#include <gtest/gtest.h>

#include <dirent.h>

#include <memory>
#include <vector>

#include "common/core/clock.h"
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
using test::receive_until;
using test::zmtp_frame;
using test::zmtp_opening;

constexpr double kDeadline_s = test::patient(20);
constexpr size_t kMost = 8;
const wire::Goodbye kGoodbye{InstanceId{7}};

// A socket that takes eight connections.
struct Bound {
  explicit Bound(Kind kind, Access access = {}, std::string_view serves = {})
      : context(std::move(access)), socket(context, kind, "bound", {.serves = serves, .most_connections = kMost}) {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound.ok()) << (bound ? "" : bound.error().text);
    if (bound) endpoint = *bound;
  }
  bool refuses(uint64_t n) {
    return receive_until(socket, [&] { return socket.connections_refused() >= n; });
  }
  Context context;
  Socket socket;
  std::string endpoint;
};

struct Friend {
  explicit Friend(const Bound& bound, Access access = {})
      : context(std::move(access)), socket(context, Kind::kDealer, "friend", {.linger_ms = 0}) {
    EXPECT_TRUE(socket.connect(bound.endpoint).ok());
  }
  Context context;
  Socket socket;
};

// True if the friend's message arrives and is answered.
bool is_served(Bound& bound, Friend& by, double deadline_s = kDeadline_s) {
  if (!by.socket.send(kGoodbye)) return false;
  std::vector<Message> got, answer;
  if (!receive_until(
          bound.socket, [&] { return !got.empty() && got.back().type == wire::Goodbye::kName; }, &got, deadline_s))
    return false;
  return bound.socket.send(wire::Shutdown{"thanks"}, got.back().peer) &&
         receive_until(
             by.socket, [&] { return !answer.empty(); }, &answer, deadline_s);
}

int open_files() {
  int out = 0;
  DIR* folder = opendir("/proc/self/fd");
  while (folder && readdir(folder)) ++out;
  if (folder) closedir(folder);
  return out;
}

using Peers = std::vector<std::unique_ptr<RawPeer>>;

TEST(HostilePeers, ConnectionsBeyondTheLimitAreRefusedAndFriendsStay) {
  Bound bound(Kind::kRouter);
  Friend before(bound);
  ASSERT_TRUE(is_served(bound, before));
  Peers strangers;
  for (size_t i = 1; i < kMost; ++i) {
    strangers.push_back(std::make_unique<RawPeer>(bound.endpoint));
    ASSERT_TRUE(strangers.back()->shake_hands("DEALER"));
    ASSERT_TRUE(strangers.back()->send(zmtp_frame("rubbish", false)));
    ASSERT_TRUE(receive_until(bound.socket, [&] { return bound.socket.rejected() >= i; }));
  }
  EXPECT_EQ(bound.socket.connections_refused(), 0u);
  for (uint64_t n = 1; n <= 20; ++n) {
    RawPeer one_more(bound.endpoint);
    EXPECT_TRUE(one_more.wait_hung_up(5000)) << n;
    ASSERT_TRUE(bound.refuses(n));
  }
  EXPECT_EQ(bound.socket.rejected(), kMost - 1) << "who is refused is not counted as one who sent nothing";
  EXPECT_TRUE(is_served(bound, before)) << "friends stay";
  // Another friend waits until a place is free, and needs no restart.
  Friend after(bound);
  EXPECT_FALSE(is_served(bound, after, 1));
  strangers.pop_back();
  EXPECT_TRUE(receive_until(bound.socket, [&] { return is_served(bound, after, 1); }));
  EXPECT_TRUE(is_served(bound, before));
}

TEST(HostilePeers, WhoHoldsPlacesWithoutAWordKeepsNobodyOut) {
  Bound bound(Kind::kRouter);
  Peers strangers;
  for (size_t i = 0; i < 3 * kMost; ++i) strangers.push_back(std::make_unique<RawPeer>(bound.endpoint));
  ASSERT_TRUE(bound.refuses(2 * kMost));
  Friend comes(bound);
  EXPECT_TRUE(is_served(bound, comes, 2));
}

class OfEachKind : public ::testing::TestWithParam<Kind> {};

// The limit holds even if the socket's owner does not look.
TEST_P(OfEachKind, NoMoreFilesAreOpenThanConnectionsMayBe) {
  Bound bound(GetParam());
  Peers strangers;
  for (int i = 0; i < 300; ++i) strangers.push_back(std::make_unique<RawPeer>(bound.endpoint));
  const double until = monotonic_s() + kDeadline_s;
  const auto few = [&] { return open_files() <= 300 + int(kMost) + 40; };
  // At first most of them wait to be accepted, and count for no socket.
  while ((!few() || bound.socket.connections_refused() < 200) && monotonic_s() < until) wait_readable({}, 10);
  EXPECT_TRUE(few()) << open_files();
  EXPECT_GE(bound.socket.connections_refused(), 200u);
}

// Three peers send nothing, or too little: all are closed after five seconds.
TEST_P(OfEachKind, WhoDoesNotShakeHandsIsHungUpOn) {
  Bound bound(GetParam());
  RawPeer silent(bound.endpoint), greets(bound.endpoint), trickles(bound.endpoint);
  ASSERT_TRUE(greets.send(zmtp_opening("DEALER").substr(0, 64)));
  ASSERT_TRUE(trickles.send(zmtp_opening("DEALER").substr(0, 70)));
  const double begin_s = monotonic_s();
  EXPECT_TRUE(silent.wait_hung_up(10000));
  EXPECT_TRUE(greets.wait_hung_up(3000));
  EXPECT_TRUE(trickles.wait_hung_up(3000));
  EXPECT_GT(monotonic_s() - begin_s, 3);
  EXPECT_LT(monotonic_s() - begin_s, 9);
  EXPECT_EQ(bound.socket.connections_refused(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Kinds, OfEachKind, ::testing::Values(Kind::kRouter, Kind::kPull, Kind::kPub),
                         [](const auto& info) {
                           return info.param == Kind::kRouter ? "Router" : info.param == Kind::kPull ? "Pull" : "Pub";
                         });

TEST(Keys, ConnectionsBeyondTheLimitAreRefusedAndFriendsStay) {
  const KeyFolder keys;
  Bound bound(Kind::kRouter, keys.server(), "control");
  std::vector<std::unique_ptr<Friend>> friends;
  for (size_t i = 0; i < kMost; ++i) {
    friends.push_back(std::make_unique<Friend>(bound, keys.of(Role::kSampler)));
    ASSERT_TRUE(is_served(bound, *friends.back()));
  }
  EXPECT_EQ(bound.socket.connections_refused(), 0u);
  Friend one_more(bound, keys.of(Role::kSampler));
  EXPECT_FALSE(is_served(bound, one_more, 1));
  EXPECT_TRUE(bound.refuses(1));
  EXPECT_EQ(bound.socket.keys_refused(), 0u) << "its key is good";
  for (auto& f : friends) EXPECT_TRUE(is_served(bound, *f));
  friends.pop_back();
  EXPECT_TRUE(receive_until(bound.socket, [&] { return is_served(bound, one_more, 1); }));
}

// Peers without a key cannot keep out peers with one.
TEST(Keys, WhoHoldsPlacesWithoutAKeyKeepsNobodyOut) {
  const KeyFolder keys;
  Bound bound(Kind::kRouter, keys.server(), "control");
  Friend before(bound, keys.of(Role::kSampler));
  ASSERT_TRUE(is_served(bound, before));
  Peers strangers;
  for (size_t i = 0; i < 5 * kMost; ++i) {
    strangers.push_back(std::make_unique<RawPeer>(bound.endpoint));
    strangers.back()->send(zmtp_opening("DEALER").substr(0, 12));
  }
  ASSERT_TRUE(bound.refuses(4 * kMost));
  Friend comes(bound, keys.of(Role::kViewer));
  EXPECT_TRUE(is_served(bound, comes, 2));
  EXPECT_TRUE(is_served(bound, before, 2));
}

}  // namespace
}  // namespace telesplat::net
