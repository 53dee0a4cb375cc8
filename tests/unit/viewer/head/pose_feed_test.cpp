// Poses over sockets, valid and invalid.
#include "client/viewer/input/pose_feed.h"

#include <gtest/gtest.h>

#include <chrono>

#include "common/core/clock.h"

namespace telesplat::viewer {
namespace {

constexpr double kPatience_s = 10;

std::unique_ptr<net::PlainPublisher> publisher() {
  auto made = net::PlainPublisher::bind("tcp://127.0.0.1:*", false);
  EXPECT_TRUE(made);
  return std::move(*made);
}

void send(net::PlainPublisher& to, double x) {
  to.send(wire::encode_head_pose({std::nullopt, {{x, 0, 0}, {1, 0, 0, 0}}}));
}

// Waits until `there` is true; returns false after kPatience_s.
bool wait_for(const std::function<bool()>& there) {
  for (const double until_s = monotonic_s() + kPatience_s; monotonic_s() < until_s;) {
    if (there()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

TEST(PoseFeed, HearsAPublisherThatComesLater) {
  const auto first = publisher();
  auto feed = PoseFeed::open({.endpoint = first->endpoint(), .prediction = tracking::Prediction::kNone});
  ASSERT_TRUE(feed);
  EXPECT_FALSE((*feed)->begin_frame(monotonic_s()).has_value());
  ASSERT_TRUE(wait_for([&] {
    send(*first, 3);
    const auto pose = (*feed)->begin_frame(monotonic_s());
    return pose && pose->position_room.x == 3;
  }));
}

TEST(PoseFeed, OutlivesWhatIsNoPose) {
  const auto hostile = publisher();
  auto feed = PoseFeed::open({.endpoint = hostile->endpoint(), .prediction = tracking::Prediction::kNone});
  ASSERT_TRUE(feed);
  ASSERT_TRUE(wait_for([&] { return hostile->heard(); }));
  for (const std::string& bytes :
       {std::string(), std::string("hello"), std::string(3000, '\x93'), std::string(1 << 20, 'x')})
    hostile->send(bytes);
  ASSERT_TRUE(wait_for([&] { return (*feed)->figures().refused >= 3; }));
  // The last message was over the socket's size limit; the connection ended, and the feed connected again.
  ASSERT_TRUE(wait_for([&] {
    hostile->heard();
    send(*hostile, 5);
    return (*feed)->begin_frame(monotonic_s()).has_value();
  }));
}

TEST(PoseFeed, AFloodIsBoundedAndTold) {
  const auto flood = publisher();
  auto feed = PoseFeed::open({.endpoint = flood->endpoint(), .prediction = tracking::Prediction::kNone});
  ASSERT_TRUE(feed);
  ASSERT_TRUE(wait_for([&] { return flood->heard(); }));
  std::string told;
  uint64_t sent = 0;
  const double begin_s = monotonic_s();
  ASSERT_TRUE(wait_for([&] {
    for (int i = 0; i < 20'000; ++i, ++sent) send(*flood, 1);
    if (const auto news = (*feed)->take_news(monotonic_s())) told += *news;
    return told.find("messages a second") != std::string::npos || sent > 5'000'000;
  }));
  // On a machine too slow for such a flood there is no news.
  const double most = PoseFeed::kMost_s * (1.2 * (monotonic_s() - begin_s) + 0.02);  // turns of 0.01 s are whole
  EXPECT_LE(double((*feed)->figures().poses), most);
}

TEST(PoseFeed, RefusesWhatIsNoEndpoint) {
  for (const char* endpoint :
       {"", "tcp://", "tcp://:1", "tcp://host", "tcp://host:0", "tcp://host:70000", "udp://host:1", "tcp://host:1x"})
    EXPECT_NE(complain_about_publisher(endpoint), "") << endpoint;
  EXPECT_EQ(complain_about_publisher("tcp://127.0.0.1:7790"), "");
  EXPECT_EQ(complain_about_publisher("ipc:///tmp/poses"), "");
}

TEST(PlainPublisher, StaysOnThisMachineUnlessTold) {
  EXPECT_FALSE(net::PlainPublisher::bind("tcp://0.0.0.0:*", false));
  EXPECT_TRUE(net::PlainPublisher::bind("tcp://0.0.0.0:*", true));
}

}  // namespace
}  // namespace telesplat::viewer
