// Messages for peers that do not read are bounded in bytes, and do not harm other peers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "common/core/clock.h"
#include "common/net/service.h"
#include "common/net/socket.h"
#include "common/wire/messages.h"
#include "tests/support/keys/key_folder.h"
#include "tests/support/patience.h"
#include "tests/support/raw_peer.h"

namespace telesplat::net {
namespace {

using test::KeyFolder;
using test::RawPeer;
using test::zmtp_frame;

constexpr double kDeadline_s = test::patient(30);
constexpr size_t kBody = 1 << 16, kLimit = 4 << 20, kKernel = 16 << 20;  // kernels keep less
const wire::Goodbye kGoodbye{InstanceId{7}};

struct Bound {
  explicit Bound(Kind kind, Access access = {}, std::string_view serves = {})
      : context(std::move(access)),
        socket(context, kind, "bound", {.high_water_mark = 100'000, .serves = serves, .most_queued_bytes = kLimit}) {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound.ok());
    if (bound) endpoint = *bound;
  }
  std::optional<Message> next() {
    for (const double until = monotonic_s() + kDeadline_s; monotonic_s() < until; wait_readable({&socket}, 5))
      if (auto m = socket.receive()) return m;
    return std::nullopt;
  }
  Context context;
  Socket socket;
  std::string endpoint;
};

TEST(HostilePeers, WhatNobodyReadsIsBoundedInBytes) {
  Bound bound(Kind::kRouter);
  RawPeer deaf(bound.endpoint);
  ASSERT_TRUE(deaf.shake_hands("DEALER"));
  ASSERT_TRUE(deaf.send(zmtp_frame("goodbye", true) + zmtp_frame(wire::encode(kGoodbye), false)));
  const auto asks = bound.next();
  ASSERT_TRUE(asks);
  const double before_mb = resident_mb();
  size_t sent = 0;
  for (int i = 0; i < 5000; ++i) sent += bound.socket.send_frames(asks->peer, "x", std::string(kBody, 'x'));
  EXPECT_GE(sent * kBody, kLimit / 2);
  EXPECT_LE(sent * kBody, kLimit + kKernel);
  EXPECT_EQ(bound.socket.queue_refused(), 5000 - sent);
  EXPECT_LT(resident_mb() - before_mb, 40);
  // A peer that reads gets everything, any number of bytes.
  Context context;
  Socket reads(context, Kind::kDealer, "reads", {.max_message_bytes = wire::kMaxBulkBytes});
  ASSERT_TRUE(reads.connect(bound.endpoint).ok());
  ASSERT_TRUE(reads.send(kGoodbye));
  const auto other = bound.next();
  ASSERT_TRUE(other);
  int got = 0;
  const double until = monotonic_s() + kDeadline_s;
  for (int asked = 0; got < 1000 && monotonic_s() < until; wait_readable({&reads}, 5)) {
    for (; asked < std::min(got + 32, 1000); ++asked)
      EXPECT_TRUE(bound.socket.send_frames(other->peer, "x", std::string(kBody, 'x'))) << asked;
    while (reads.receive()) ++got;
  }
  EXPECT_EQ(got, 1000);
  EXPECT_EQ(bound.socket.queue_refused(), 5000 - sent);
  // A single message may exceed the limit.
  ASSERT_TRUE(bound.socket.send_frames(other->peer, "x", std::string(3 * kLimit, 'x')));
  EXPECT_TRUE(wait_readable({&reads}, 10000));
}

// A publisher with two subscribers, one that reads and one that does not: with keys, and without.
void expect_reader_served(Bound& bound, Socket& reads, const std::function<bool()>& deaf_is_gone) {
  const double until = monotonic_s() + kDeadline_s;
  int published = 0, first = 0, got = 0, missed = 0;
  const auto publish = [&](size_t size) {
    std::string body(size, 'x');
    std::memcpy(body.data(), &published, sizeof published);
    EXPECT_TRUE(bound.socket.send_frames({}, "x", body));
    ++published;
  };
  const auto receive = [&] {
    while (const auto m = reads.receive()) {
      int number = -1;
      if (m->body.size() >= sizeof number) std::memcpy(&number, m->body.data(), sizeof number);
      if (got == 0) first = number;  // earlier messages had no subscriber
      missed += number != first + got;
      ++got;
    }
  };
  while (got == 0 && monotonic_s() < until) {  // until the subscription counts
    publish(100);
    wait_readable({&reads}, 20);
    receive();
  }
  const double before_mb = resident_mb();
  double most_mb = 0;
  while ((published < 3000 || got < published - first) && monotonic_s() < until) {
    // Half of the limit for waiting messages: with more, a slow reader would be late as well.
    if (published < 3000 && published - first - got < 16) publish(kBody);
    if (published % 100 == 0) most_mb = std::max(most_mb, resident_mb() - before_mb);
    wait_readable({&reads}, published < 3000 ? 0 : 5);
    receive();
  }
  EXPECT_EQ(published, 3000);
  EXPECT_EQ(got, published - first) << "who reads misses nothing";
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(bound.socket.queue_refused(), 1u);
  EXPECT_LT(most_mb, 80) << "197 MB were published";
  EXPECT_TRUE(deaf_is_gone());
}

TEST(HostilePeers, ASubscriberWhoDoesNotReadIsHungUpOnAndFriendsMissNothing) {
  Bound bound(Kind::kPub);
  RawPeer deaf(bound.endpoint);
  ASSERT_TRUE(deaf.shake_hands("SUB"));
  ASSERT_TRUE(deaf.send(zmtp_frame("\x01", false)));
  Context context;
  Socket reads(context, Kind::kSub, "reads", {.max_message_bytes = wire::kMaxBulkBytes});
  ASSERT_TRUE(reads.connect(bound.endpoint).ok());
  expect_reader_served(bound, reads, [&] { return deaf.wait_hung_up(5000); });
}

TEST(Keys, ASubscriberWhoDoesNotReadIsHungUpOnAndFriendsMissNothing) {
  const KeyFolder keys;
  Bound bound(Kind::kPub, keys.server(), "patches");
  Context context(keys.of(Role::kViewer));
  // Its owner never reads.
  Socket deaf(context, Kind::kSub, "deaf", {.high_water_mark = 1, .max_message_bytes = wire::kMaxBulkBytes});
  Socket reads(context, Kind::kSub, "reads", {.max_message_bytes = wire::kMaxBulkBytes});
  ASSERT_TRUE(deaf.connect(bound.endpoint).ok());
  ASSERT_TRUE(reads.connect(bound.endpoint).ok());
  expect_reader_served(bound, reads, [] { return true; });
}

}  // namespace
}  // namespace telesplat::net
