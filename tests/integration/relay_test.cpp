// The relay of simulated links by itself: what comes through, when, and what a target that is gone ends.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <memory>
#include <string>
#include <thread>

#include "common/core/clock.h"
#include "tools/wan_relay/relay.h"

namespace telesplat::wan_relay {
namespace {

// A place to listen at, of this process, and who connects to it.
class Listener {
 public:
  Listener() : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(fd_, 8), 0);
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~Listener() { ::close(fd_); }
  const std::string& address() const { return address_; }
  int accept() const {
    pollfd p{fd_, POLLIN, 0};
    return ::poll(&p, 1, 10000) > 0 ? ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC) : -1;
  }

 private:
  int fd_;
  std::string address_;
};

// Reads `n` bytes, or what comes until the other side has ended.
std::string read_bytes(int fd, size_t n) {
  std::string out(n, '\0');
  size_t have = 0;
  for (ssize_t got = 1; have < n && got > 0; have += size_t(std::max<ssize_t>(got, 0)))
    got = ::recv(fd, out.data() + have, n - have, 0);
  out.resize(have);
  return out;
}

// A relay on a thread of its own.
class RunningRelay {
 public:
  RunningRelay(const std::string& to, const std::string& link) {
    options_.listen = {"127.0.0.1:*"};
    options_.to = {to};
    options_.link_text = link;
    EXPECT_TRUE(settle(options_).ok());
    auto opened = Relay::open(options_);
    EXPECT_TRUE(opened.ok()) << opened.error().text;
    relay_ = *std::move(opened);
    thread_ = std::thread([this] {
      relay_->run([](const std::string&) {});
      ended_ = true;
    });
  }
  int connect() const {
    const std::string address = relay_->addresses().at(0);
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(uint16_t(std::stoi(address.substr(address.rfind(':') + 1))));
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    return fd;
  }
  bool ended() const { return ended_; }
  // Messages that passed.
  std::string end() {
    kill(getpid(), SIGTERM);
    thread_.join();
    return relay_->statistics();
  }

 private:
  Options options_;  // which the relay refers to
  std::unique_ptr<Relay> relay_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

TEST(RelayInProcess, DelaysLimitsAndKeepsEveryByte) {
  Listener far;
  RunningRelay relay(far.address(), "rtt=60ms,rate=40mbit");
  const int near = relay.connect(), there = far.accept();
  ASSERT_GE(there, 0);
  const double asked_s = monotonic_s();
  ASSERT_EQ(::send(near, "?", 1, 0), 1);
  EXPECT_EQ(read_bytes(there, 1), "?");
  ASSERT_EQ(::send(there, "!", 1, 0), 1);
  EXPECT_EQ(read_bytes(near, 1), "!");
  EXPECT_GE(monotonic_s() - asked_s, 0.06);
  EXPECT_LT(monotonic_s() - asked_s, 0.5) << "it takes much longer than the link";

  std::string bytes(2'500'000, '\0');  // half a second's
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = char(i * 2654435761u >> 13);
  const double begin_s = monotonic_s();
  std::thread sender([&] {
    for (size_t sent = 0; sent < bytes.size();) {
      const ssize_t n = ::send(there, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) break;
      sent += size_t(n);
    }
    ::shutdown(there, SHUT_WR);
  });
  const std::string got = read_bytes(near, bytes.size() + 1);  // and its end
  sender.join();
  EXPECT_EQ(got == bytes, true) << got.size() << " bytes came";
  EXPECT_GE(monotonic_s() - begin_s, 0.5 + 0.03 - 1e-3);
  // The other direction is open still.
  ASSERT_EQ(::send(near, "bye", 3, 0), 3);
  ::shutdown(near, SHUT_WR);
  EXPECT_EQ(read_bytes(there, 10), "bye");
  ::close(near);
  ::close(there);
  const std::string passed = relay.end();
  EXPECT_NE(passed.find("1 connections"), std::string::npos) << passed;
  EXPECT_NE(passed.find("to the near side 2.500 MB"), std::string::npos) << passed;
}

TEST(RelayInProcess, ADeadTargetEndsTheConnectionAlone) {
  std::string nowhere;
  {
    Listener gone;
    nowhere = gone.address();
  }
  RunningRelay relay(nowhere, "1ms");
  for (int i = 0; i < 3; ++i) {
    const int near = relay.connect();
    EXPECT_EQ(read_bytes(near, 1), "");
    ::close(near);
  }
  EXPECT_FALSE(relay.ended());
  const std::string passed = relay.end();
  EXPECT_NE(passed.find("3 connections, 0 open, 3 failed"), std::string::npos) << passed;
}

}  // namespace
}  // namespace telesplat::wan_relay
