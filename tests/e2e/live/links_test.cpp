// Simulated links: the relay by itself, and runs whose processes are apart.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <filesystem>
#include <thread>

#include "common/core/clock.h"
#include "tests/support/pipeline_run.h"
#include "tests/support/raw_peer.h"

namespace telesplat::test {
namespace {

// The relay that a run has started.
pid_t relay_of(pid_t launcher) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    if (!std::isdigit(entry.path().filename().string()[0])) continue;
    const std::string stat = read_text(entry.path().string() + "/stat");
    const size_t end = stat.rfind(')');
    if (end == std::string::npos || stat.find("(telesplat-wan-r") == std::string::npos) continue;
    char state = 0;
    int parent = 0;
    if (std::sscanf(stat.c_str() + end + 1, " %c %d", &state, &parent) == 2 && parent == launcher && state != 'Z')
      return std::atoi(entry.path().filename().c_str());
  }
  return 0;
}

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

class RelayProgram {
 public:
  RelayProgram(const TemporaryFolder& folder, std::vector<std::string> arguments)
      : program_("telesplat-wan-relay", std::move(arguments), folder / "relay") {
    EXPECT_TRUE(wait_until([&] {
      const std::string out = program_.out();
      return out.find('\n') != std::string::npos;
    })) << program_.err();
    const std::string line = program_.out();
    address_ = line.substr(0, line.find('\n')).substr(line.rfind("listening on ", line.find('\n')) + 13);
  }
  int connect() const {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(uint16_t(std::atoi(address_.substr(address_.rfind(':') + 1).c_str())));
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    return fd;
  }
  Program& program() { return program_; }

 private:
  Program program_;
  std::string address_;
};

TEST(Relay, DelaysLimitsAndKeepsEveryByte) {
  TemporaryFolder folder;
  Listener far;
  RelayProgram relay(folder, {"--listen", "127.0.0.1:*", "--to", far.address(), "--link", "rtt=60ms,rate=40mbit"});
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
  relay.program().signal(SIGUSR1);
  EXPECT_TRUE(wait_until([&] { return relay.program().err().find("1 connections") != std::string::npos; }));
  relay.program().signal(SIGTERM);
  EXPECT_EQ(relay.program().wait(), 0);
  EXPECT_NE(relay.program().err().find("to the near side 2.500 MB"), std::string::npos) << relay.program().err();
}

// The launcher sends the signal twice, and the second may come when the relay has left its loop.
TEST(Relay, TellsWhatPassedHoweverOftenItIsToldToEnd) {
  TemporaryFolder folder;
  for (int i = 0; i < 20; ++i) {
    RelayProgram relay(folder, {"--socks", "127.0.0.1:*"});
    do relay.program().signal(SIGTERM);
    while (relay.program().wait(0) < 0);
    EXPECT_NE(relay.program().err().find("to the near side"), std::string::npos) << relay.program().err();
  }
}

TEST(Relay, ADeadTargetEndsTheConnectionAlone) {
  TemporaryFolder folder;
  std::string nowhere;
  {
    Listener gone;
    nowhere = gone.address();
  }
  RelayProgram relay(folder, {"--listen", "127.0.0.1:*", "--to", nowhere});
  for (int i = 0; i < 3; ++i) {
    const int near = relay.connect();
    EXPECT_EQ(read_bytes(near, 1), "");
    ::close(near);
  }
  EXPECT_EQ(relay.program().wait(0), -1) << "it has ended";
  EXPECT_NE(relay.program().err().find("no connection to " + nowhere), std::string::npos);
}

TEST(Links, ARunThroughALinkShowsItsPictureAndTellsOfIt) {
  PipelineRun run({"--duration", "4", "--link", "60ms:50mbit"});
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["links"], (nlohmann::json{{"viewer-1", "rtt=60ms,rate=50mbit"}}));
  EXPECT_GT(s["updates"], 3);
  EXPECT_GT(s["points_cached"], 1000);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  // Request, plan, sampling and the way back: no update can be quicker than the link.
  for (const double ms : run.column("updates.csv", "latency_ms")) EXPECT_GE(ms, 60);
  EXPECT_NE(read_text(run.out() + "/session.toml").find("\"link\" = \"rtt=60ms,rate=50mbit\""), std::string::npos);
  EXPECT_NE(run.program().out().find("rtt=60ms,rate=50mbit (of viewer-1)"), std::string::npos) << run.program().out();
  // All that the viewer received went through it.
  const std::string log = read_text(run.out() + "/logs/link-viewer-1.log");
  EXPECT_NE(log.find("to the near side"), std::string::npos) << log;
}

TEST(Links, AVolumeAndItsDataServersGoThroughTheirLinks) {
  TemporaryFolder folder;
  const std::string volume = folder / "balls.mha";
  write_volume(volume);
  PipelineRun run({"--duration", "3", "--link", "rtt=40ms", "--link", "data:rtt=30ms", "--link", "sampler:20ms"},
                  volume);
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["links"], (nlohmann::json{{"viewer-1", "rtt=40ms"}, {"sampler-1", "rtt=20ms data:rtt=30ms"}}));
  EXPECT_GT(s["updates"], 3);
  for (const double ms : run.column("updates.csv", "latency_ms")) EXPECT_GE(ms, 60) << "both links, there and back";
  for (const char* link : {"viewer-1", "sampler-1", "data"}) {
    const std::string log = read_text(run.out() + "/logs/link-" + link + ".log");
    EXPECT_NE(log.find("to the near side"), std::string::npos) << link << ": " << log;
    EXPECT_EQ(log.find("to the near side 0.000 MB"), std::string::npos) << link << ": " << log;
  }
}

// A packer comes back at other ports; a viewer that gave up the old ones while they were refused died of it.
TEST(Links, ARelayAndAPackerThatAreStartedAgainAreFoundThroughTheLink) {
  PipelineRun run({"--duration", "0", "--link", "rtt=20ms"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const pid_t relay = relay_of(run.program().pid());
  ASSERT_GT(relay, 0);
  ::kill(relay, SIGKILL);
  EXPECT_TRUE(wait_until([&] {
    const pid_t next = relay_of(run.program().pid());
    return next > 0 && next != relay;
  }));
  EXPECT_NE(run.program().err().find("link-viewer-1 died (signal 9); the run goes on, it is started again"),
            std::string::npos)
      << run.program().err();
  const auto expect_updates = [&] {
    double updates = -1;
    EXPECT_TRUE(run.wait_status([&](const auto& s) {
      if (updates < 0) updates = value(s, "viewer-1", "updates");
      return value(s, "viewer-1", "updates") > updates + 3;
    })) << run.program().err();
  };
  expect_updates();
  const auto packer = [&] {
    pid_t pid = 0;
    run.wait_status([&](const auto& s) {
      const auto p = process(s, "packer");
      if (p.is_object() && p["alive"]) pid = p["pid"].template get<pid_t>();
      return pid > 0;
    });
    return pid;
  };
  for (int times = 0; times < 2; ++times) {
    const pid_t victim = packer();
    ASSERT_GT(victim, 0);
    ::kill(victim, SIGKILL);
    EXPECT_TRUE(wait_until([&] {
      const pid_t next = packer();
      return next > 0 && next != victim;
    }));
    expect_updates();
  }
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
}

// Errors within bounds, and none of them where the head has come to rest.
TEST(Links, PointsHaveErrorsUntilTheHeadRests) {
  auto flags = kComesToRest;
  flags.insert(flags.end(), {"--size", "640x400", "--link", "20ms", "--depth-error", "1/16", "--normal-error", "2",
                             "--colour-error", "off"});
  PipelineRun run(flags);
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  const auto errors = s["errors_allowed"];
  ASSERT_TRUE(errors.is_object());
  EXPECT_GT(errors["patches"], 0);
  EXPECT_GT(errors["patches_refined"], 0);
  EXPECT_GT(errors["depth_m"], 0);
  EXPECT_LT(errors["depth_m"], 1e-3);
  EXPECT_GT(errors["normal_deg"], 0);
  EXPECT_EQ(errors["colour"], 0);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  const auto depth = run.column("tiles.csv", "depth_error_m");
  EXPECT_EQ(*std::max_element(depth.begin(), depth.end()), double(errors["depth_m"]));
}

}  // namespace
}  // namespace telesplat::test
