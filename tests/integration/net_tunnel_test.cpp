// Sockets that connect through a SOCKS5 proxy: bytes pass, and sockets survive the end of proxy or target.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/net/socket.h"
#include "tests/support/patience.h"
#include "tools/wan_relay/relay.h"

namespace telesplat::net {
namespace {

constexpr double kDeadline_s = test::patient(20);

// Returns an address of this machine where no process listens.
std::string nobody() {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  ::close(fd);
  return "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

Access through(const std::string& proxy) { return *Via::parse({proxy}); }

class Proxy {
 public:
  Proxy() {
    options_.socks = {"127.0.0.1:0"};
    options_.link_text = "1ms";
    EXPECT_TRUE(settle(options_).ok());
    auto opened = wan_relay::Relay::open(options_);
    EXPECT_TRUE(opened.ok()) << opened.error().text;
    relay_ = *std::move(opened);
    thread_ = std::thread([this] { relay_->run([](const std::string&) {}); });
  }
  ~Proxy() {
    kill(getpid(), SIGTERM);
    thread_.join();
  }
  std::string address() const { return relay_->addresses().at(0); }

 private:
  wan_relay::Options options_;  // the relay refers to them
  std::unique_ptr<wan_relay::Relay> relay_;
  std::thread thread_;
};

bool until(const auto& done) {
  for (const double end = monotonic_s() + kDeadline_s; monotonic_s() < end;
       std::this_thread::sleep_for(std::chrono::milliseconds(5)))
    if (done()) return true;
  return false;
}

// ZeroMQ's own support of proxies ends the process here.
TEST(Tunnel, AProxyThatIsNotThereEndsNobody) {
  Context context(through(nobody()));
  Socket socket(context, Kind::kDealer, "viewer", {.linger_ms = 100, .watch_connecting = true});
  ASSERT_TRUE(socket.connect("tcp://127.0.0.1:7700").ok());
  EXPECT_TRUE(until([&] { return socket.failed_connections() >= 2; }));
  EXPECT_EQ(socket.refusal().text, "") << "nobody has refused anything";
}

TEST(Tunnel, ATargetThatIsNotThereIsAFailedConnection) {
  const Proxy proxy;
  Context context(through(proxy.address()));
  Socket socket(context, Kind::kDealer, "viewer", {.linger_ms = 100, .watch_connecting = true});
  ASSERT_TRUE(socket.connect("tcp://" + nobody()).ok());
  EXPECT_TRUE(until([&] { return socket.failed_connections() >= 2; }));
  EXPECT_EQ(socket.refusal().text, "");
}

// Sends megabytes each way; then to a new server at the same place, and last the message of a closed socket.
TEST(Tunnel, WhatIsSentComesThroughAndConnectionsAreMadeAnew) {
  const Proxy proxy;
  Context here, there(through(proxy.address()));
  const auto chunk = [](uint64_t id) { return wire::Chunk{EpochId{1}, ChunkId{id}, {}}; };
  const std::vector<std::byte> bytes(3 << 20, std::byte{7});
  std::string endpoint = "tcp://127.0.0.1:*";
  auto client = std::make_unique<Socket>(there, Kind::kDealer, "sampler",
                                         SocketOptions{.max_message_bytes = 8 << 20, .watch_connecting = true});
  for (uint64_t life = 1; life <= 2; ++life) {
    Socket server(here, Kind::kRouter, "data", {.max_message_bytes = 8 << 20});
    ASSERT_TRUE(until([&] {  // ZeroMQ takes its time to close the last one
      const auto bound = server.bind(endpoint);
      if (bound) endpoint = *bound;
      return bound.ok();
    }));
    if (life == 1) {
      ASSERT_TRUE(client->connect(endpoint).ok());
    }
    uint64_t heard = 0, answered = 0;
    std::optional<double> asked_s;
    ASSERT_TRUE(until([&] {
      if (!asked_s || monotonic_s() - *asked_s > 1) {  // a message may be lost while a connection breaks
        wire::Chunk big = chunk(life);
        big.data = bytes;
        client->send(big);
        asked_s = monotonic_s();
      }
      while (const auto message = server.receive())
        dispatch<wire::Chunk>(server, *message, [&](const wire::Chunk& m) {
          heard += m.data.size() == bytes.size() && m.chunk.value == life;
          server.send(m, message->peer);
        });
      while (const auto message = client->receive())
        dispatch<wire::Chunk>(*client, *message,
                              [&](const wire::Chunk& m) { answered += m.data.size() == bytes.size(); });
      return heard > 0 && answered > 0;
    })) << "life "
        << life;
    if (life == 2) {
      client->send(wire::Goodbye{InstanceId{5}});
      client.reset();
      bool left = false;
      EXPECT_TRUE(until([&] {
        while (const auto message = server.receive()) left |= message->type == wire::Goodbye::kName;
        return left;
      }));
    }
  }
}

}  // namespace
}  // namespace telesplat::net
