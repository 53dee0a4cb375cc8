// The relay's input: its flags, and clients that name their destination.
#include <gtest/gtest.h>

#include "tools/wan_relay/options.h"
#include "tools/wan_relay/socks.h"

namespace telesplat::wan_relay {
namespace {

using namespace std::string_literals;
using State = SocksDialogue::State;

const std::string kGreeting = "\x05\x01\x00"s, kToAddress = "\x05\x01\x00\x01\x7f\x00\x00\x01\x1e\x14"s;

TEST(Socks, ConnectsToAnAddress) {
  SocksDialogue d;
  ASSERT_TRUE(d.take(kGreeting));
  EXPECT_EQ(d.take_answer(), "\x05\x00"s);
  EXPECT_EQ(d.take_answer(), "");
  EXPECT_EQ(d.state(), State::kRequest);
  ASSERT_TRUE(d.take(kToAddress));
  EXPECT_EQ(d.state(), State::kAsked);
  EXPECT_EQ(d.host(), "127.0.0.1");
  EXPECT_EQ(d.port(), 7700);
}

TEST(Socks, TakesAnyPieces) {
  SocksDialogue d;
  for (const char c : kGreeting + kToAddress) ASSERT_TRUE(d.take(std::string(1, c)));
  EXPECT_EQ(d.host(), "127.0.0.1");
}

TEST(Socks, ConnectsToNamesAndIpv6) {
  SocksDialogue name, v6;
  ASSERT_TRUE(name.take(kGreeting + "\x05\x01\x00\x03\x09localhost\x00\x50"s));
  EXPECT_EQ(name.host(), "localhost");
  EXPECT_EQ(name.port(), 80);
  ASSERT_TRUE(v6.take(kGreeting + "\x05\x01\x00\x04"s + std::string(15, '\0') + "\x01\x00\x50"s));
  EXPECT_EQ(v6.host(), "0:0:0:0:0:0:0:1");
}

TEST(Socks, RefusesWhatItDoesNotDo) {
  const auto refused = [](const std::string& bytes) { return !SocksDialogue().take(bytes).ok(); };
  EXPECT_TRUE(refused("GET / HTTP/1.1\r\n"));
  EXPECT_TRUE(refused("\x04\x01"s));
  EXPECT_TRUE(refused("\x05\x01\x02"s)) << "a password";
  EXPECT_TRUE(refused(kGreeting + "\x05\x02\x00\x01\x7f\x00\x00\x01\x1e\x14"s)) << "bind";
  EXPECT_TRUE(refused(kGreeting + "\x05\x01\x00\x09\x7f\x00\x00\x01\x1e\x14"s)) << "kind of address";
  EXPECT_TRUE(refused(kGreeting + kToAddress + "early")) << "does not wait";
}

Status settled(Options o) { return settle(o); }

TEST(RelayFlags, DoorsInPairs) {
  Options o;
  o.listen = {"127.0.0.1:*", "tcp://[::1]:7001"};
  o.to = {"127.0.0.1:7700", "host.example:80"};
  o.socks = {"127.0.0.1:0"};
  o.link_text = "20mbit";
  ASSERT_TRUE(settle(o));
  ASSERT_EQ(o.doors.size(), 3u);
  EXPECT_EQ(o.doors[0].port, "0");
  EXPECT_EQ(o.doors[1].host, "::1");
  EXPECT_EQ(o.doors[1].to_host, "host.example");
  EXPECT_TRUE(o.doors[2].to_host.empty());
  EXPECT_EQ(o.link.rate_bit_s, 2e7);
}

TEST(RelayFlags, RefusalsNameTheFlag) {
  const auto why = [](Options o) {
    const Status s = settled(std::move(o));
    return s ? "taken" : s.error().text;
  };
  EXPECT_EQ(why({}), "nothing to listen at: --listen and --to, or --socks are needed");
  EXPECT_EQ(why({.listen = {"127.0.0.1:1"}}),
            "--listen is given 1 times and --to 0 times: each --listen needs its --to");
  EXPECT_EQ(why({.socks = {"0.0.0.0:1"}}), "--socks 0.0.0.0:1: is not a loopback address; others need --insecure");
  EXPECT_EQ(why({.socks = {"0.0.0.0:1"}, .insecure = true}), "taken");
  EXPECT_EQ(why({.socks = {"localhost:1"}}), "--socks localhost:1: localhost is no address such as 127.0.0.1");
  EXPECT_EQ(why({.socks = {"127.0.0.1"}}), "--socks 127.0.0.1: is not ADDRESS:PORT");
  EXPECT_EQ(why({.socks = {"127.0.0.1:65536"}}),
            "--socks 127.0.0.1:65536: the port is not in 0..65535, nor * for a free one");
  EXPECT_EQ(why({.listen = {"127.0.0.1:1"}, .to = {"127.0.0.1:*"}}), "--to 127.0.0.1:*: the port is not in 1..65535");
  EXPECT_EQ(why({.socks = {"127.0.0.1:1"}, .link_text = "rate=0"}),
            "--link rate=0: not in 10kbit..100gbit; leave rate out for a link without a limit");
}

}  // namespace
}  // namespace telesplat::wan_relay
