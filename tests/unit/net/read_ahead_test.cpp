// The thread that reads a socket ahead of its owner.
#include "common/net/read_ahead.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "common/core/clock.h"
#include "tests/support/patience.h"

namespace telesplat::net {
namespace {

constexpr double kDeadline_s = test::patient(20);

// A socket made of queues: `given` are messages to receive, `taken` those that were sent.
struct FakeSocket {
  std::mutex mutex;
  std::deque<Message> given;
  std::vector<std::string> taken;
  std::atomic<bool> refuses{false};
  std::atomic<int> looks{0};  // the thread's looks for messages to send, or that are due

  ReadAhead::Ends ends() {
    return {.receive = [this]() -> std::optional<Message> {
              const std::lock_guard lock(mutex);
              if (given.empty()) return std::nullopt;
              Message out = std::move(given.front());
              given.pop_front();
              return out;
            },
            .send =
                [this](ReadAhead::Outgoing& o) {
                  if (refuses) return false;
                  const std::lock_guard lock(mutex);
                  taken.push_back(o.type + std::exchange(o.body, {}));
                  return true;
                },
            .wait =
                [](int descriptor, int) {
                  pollfd item{descriptor, POLLIN, 0};
                  poll(&item, 1, 1);
                },
            .due = [this]() -> std::optional<ReadAhead::Outgoing> {
              ++looks;
              return std::nullopt;
            }};
  }
  void give(size_t bytes) {
    auto body = std::make_shared<std::vector<std::byte>>(bytes);
    const std::lock_guard lock(mutex);
    given.push_back({.peer = {}, .type = "m", .body = {body->data(), body->size()}, .owner = body});
  }
  size_t waiting() {
    const std::lock_guard lock(mutex);
    return given.size();
  }
  size_t sent() {
    const std::lock_guard lock(mutex);
    return taken.size();
  }
};

template <class Done>
bool eventually(Done done) {
  for (const double until_s = monotonic_s() + kDeadline_s; monotonic_s() < until_s;) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}
bool readable(const ReadAhead& ahead) {
  pollfd item{ahead.descriptor(), POLLIN, 0};
  return poll(&item, 1, 0) == 1;
}

TEST(ReadAhead, SaysWhenThereIsSomethingAndKeepsTheOrder) {
  FakeSocket socket;
  ReadAhead ahead(socket.ends(), {});
  EXPECT_FALSE(ahead.receive());
  EXPECT_FALSE(readable(ahead));
  for (size_t i = 1; i <= 3; ++i) socket.give(i);
  ASSERT_TRUE(eventually([&] { return socket.waiting() == 0; })) << "it was read although nobody asked";
  for (size_t i = 1; i <= 3; ++i) {
    EXPECT_TRUE(eventually([&] { return readable(ahead); }));
    const auto message = ahead.receive();
    ASSERT_TRUE(message);
    EXPECT_EQ(message->body.size(), i);
  }
  EXPECT_FALSE(readable(ahead));
  EXPECT_FALSE(ahead.receive());
}

TEST(ReadAhead, StopsReadingWhenTooMuchWaits) {
  for (const ReadAhead::Limits limits : {ReadAhead::Limits{.messages = 4}, ReadAhead::Limits{.bytes = 400}}) {
    FakeSocket socket;
    ReadAhead ahead(socket.ends(), limits);
    for (int i = 0; i < 10; ++i) socket.give(100);
    ASSERT_TRUE(eventually([&] { return socket.waiting() == 6; }));
    ASSERT_TRUE(eventually([&, before = socket.looks.load()] { return socket.looks >= before + 2; }));
    EXPECT_EQ(socket.waiting(), 6u) << "the sender is held up";
    for (int i = 0; i < 10; ++i)
      ASSERT_TRUE(eventually([&] { return ahead.receive().has_value(); })) << "and goes on: " << i;
  }
}

TEST(ReadAhead, SendsInOrderAndRefusesWhatIsTooMuch) {
  FakeSocket socket;
  socket.refuses = true;
  {
    ReadAhead ahead(socket.ends(), {.unsent = 3});
    int accepted = 0;
    for (int i = 0; i < 10; ++i) accepted += ahead.send({std::to_string(i), "!"});
    EXPECT_GE(accepted, 3);
    EXPECT_LE(accepted, 4) << "one may be in the thread's hands";
    EXPECT_EQ(socket.sent(), 0u);
    socket.refuses = false;
    ASSERT_TRUE(eventually([&] { return socket.sent() == size_t(accepted); }));
    EXPECT_TRUE(ahead.send({"last", "."}));
  }
  EXPECT_EQ(socket.taken.front(), "0!");
  EXPECT_EQ(socket.taken[1], "1!");
  EXPECT_EQ(socket.taken.back(), "last.") << "what is left goes out when it ends";
}

TEST(ReadAhead, WhatEndsItsThreadIsTheOwners) {
  FakeSocket socket;
  ReadAhead::Ends ends = socket.ends();
  ends.receive = [next = ends.receive]() -> std::optional<Message> {
    auto message = next();
    if (!message) throw std::bad_alloc();
    return message;
  };
  socket.give(1);
  ReadAhead ahead(ends, {});
  ASSERT_TRUE(eventually([&] { return readable(ahead); }));
  EXPECT_TRUE(ahead.receive()) << "what came before is there";
  ASSERT_TRUE(eventually([&] { return readable(ahead); }));
  EXPECT_THROW(ahead.receive(), std::bad_alloc);
  EXPECT_THROW(ahead.receive(), std::bad_alloc) << "and so it stays";
}

TEST(ReadAhead, SaysWhatIsDueWhileItsOwnerIsAway) {
  FakeSocket socket;
  ReadAhead::Ends ends = socket.ends();
  std::atomic<int> asked{0};
  ends.due = [&]() -> std::optional<ReadAhead::Outgoing> {
    if (++asked % 3 != 0) return std::nullopt;
    return ReadAhead::Outgoing{"due", {}};
  };
  const ReadAhead ahead(ends, {});
  EXPECT_TRUE(eventually([&] { return socket.sent() >= 3; }));
}

}  // namespace
}  // namespace telesplat::net
