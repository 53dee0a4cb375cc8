// Asks a master: it answers, it refuses, or no master is there.
#include "common/net/control.h"

#include <gtest/gtest.h>

#include <thread>

#include "common/core/clock.h"

namespace telesplat::net {
namespace {

constexpr double kLong_s = 20;

TEST(Control, NobodyIsSaidAtOnce) {
  for (const std::string endpoint : {"tcp://127.0.0.1:1", "ipc:///nonexistent/telesplat"}) {
    const double begin = monotonic_s();
    const auto answer = ask_master(endpoint, "status", kLong_s);
    EXPECT_LT(monotonic_s() - begin, kLong_s / 4) << endpoint;
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().text, "no master is at " + endpoint + ": nothing takes connections there");
  }
}

TEST(Control, AHostThatIsNotFoundIsNamed) {
  const auto answer = ask_master("tcp://nohost.invalid:7700", "status", kLong_s);
  ASSERT_FALSE(answer.ok());
  EXPECT_TRUE(answer.error().text.starts_with(
      "no master is at tcp://nohost.invalid:7700: no host called nohost.invalid is found: "))
      << answer.error().text;
}

TEST(Control, MastersAreAskedAtLocalhostAndByIPv6) {
  for (const std::string address : {"tcp://localhost:*", "tcp://[::1]:*"}) {
    Context context;
    Socket master(context, Kind::kRouter, "master");
    const auto endpoint = master.bind(address);
    ASSERT_TRUE(endpoint.ok()) << endpoint.error().text;
    const std::string asked = address.substr(0, address.size() - 1) + endpoint->substr(endpoint->rfind(':') + 1);
    EXPECT_FALSE(asked.ends_with('*'));
    std::thread thread([&] {
      for (const double until = monotonic_s() + kLong_s; monotonic_s() < until;) {
        wait_readable({&master}, 20);
        const auto message = master.receive();
        if (message) return void(master.send(wire::ControlReply{true, "here"}, message->peer));
      }
    });
    const auto answer = ask_master(asked, "status", kLong_s);
    thread.join();
    ASSERT_TRUE(answer.ok()) << answer.error().text;
    EXPECT_EQ(*answer, "here");
  }
}

TEST(Control, HostsAreBoundToByTheirAddresses) {
  Context context;
  Socket master(context, Kind::kRouter, "master");
  const auto bound = master.bind("tcp://lab.example:7700", true);
  ASSERT_FALSE(bound.ok());
  EXPECT_TRUE(bound.error().text.ends_with("an address of this machine, * or the name of a network interface is meant"))
      << bound.error().text;
}

TEST(Control, SomebodyWhoSaysNothingIsWaitedFor) {
  Context context;
  Socket silent(context, Kind::kRouter, "silent");
  const auto endpoint = silent.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(endpoint.ok());
  const double begin = monotonic_s();
  const auto answer = ask_master(*endpoint, "status", 0.3);
  EXPECT_GE(monotonic_s() - begin, 0.3);
  ASSERT_FALSE(answer.ok());
  EXPECT_NE(answer.error().text.find("no answer"), std::string::npos) << answer.error().text;
}

TEST(Control, ARefusalIsAReply) {
  Context context;
  Socket master(context, Kind::kRouter, "master");
  const auto endpoint = master.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(endpoint.ok());
  std::thread answering([&] {
    for (int answered = 0; answered < 3;) {
      wait_readable({&master}, 50);
      while (const auto m = master.receive()) {
        const auto control = master.decode<wire::Control>(*m);
        if (!control) continue;
        master.send(wire::ControlReply{control->command == "status", "said to " + control->command}, m->peer);
        ++answered;
      }
    }
  });
  Socket socket(context, Kind::kDealer, "ctl", kControlSocket);
  ASSERT_TRUE(socket.connect(*endpoint).ok());
  const auto refused = reply_of_master(socket, *endpoint, "tf", kLong_s);
  const auto refused_too = ask_master(socket, *endpoint, "tf", kLong_s);
  const auto answer = ask_master(socket, *endpoint, "status", kLong_s);
  answering.join();
  ASSERT_TRUE(refused.ok());
  EXPECT_FALSE(refused->ok);
  EXPECT_EQ(refused->text, "said to tf");
  ASSERT_FALSE(refused_too.ok());
  EXPECT_EQ(refused_too.error().text, "said to tf");
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(*answer, "said to status");
  EXPECT_EQ(socket.failed_connections(), 0u);
}

}  // namespace
}  // namespace telesplat::net
