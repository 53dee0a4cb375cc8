// The metrics' HTTP endpoint with friendly and hostile clients.
#include "services/master/live/http_endpoint.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <vector>

#include "common/core/clock.h"

namespace telesplat::master {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(uint16_t(port));
  out.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return out;
}

int free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at = loopback(0);
  socklen_t size = sizeof at;
  EXPECT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&at), size), 0);
  EXPECT_EQ(getsockname(fd, reinterpret_cast<sockaddr*>(&at), &size), 0);
  close(fd);
  return ntohs(at.sin_port);
}

/// A connection that sends given texts.
class Client {
 public:
  explicit Client(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to = loopback(port);
    EXPECT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
  }
  Client(Client&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
  ~Client() {
    if (fd_ >= 0) close(fd_);
  }
  void say(const std::string& text) { (void)!send(fd_, text.data(), text.size(), MSG_NOSIGNAL); }
  /// Reads until the other side closes, or the time is over.
  std::string hear(double for_s = 10) {
    std::string out;
    for (const double until = monotonic_s() + for_s; monotonic_s() < until;) {
      pollfd p{fd_, POLLIN, 0};
      if (poll(&p, 1, 50) <= 0) continue;
      char bytes[4096];
      const ssize_t n = recv(fd_, bytes, sizeof bytes, 0);
      if (n <= 0) {
        closed = true;
        break;
      }
      out.append(bytes, size_t(n));
    }
    return out;
  }
  bool closed = false;

 private:
  int fd_;
};

class Endpoint : public testing::Test {
 protected:
  Endpoint() {
    auto opened = HttpEndpoint::open({.port = port});
    EXPECT_TRUE(opened.ok());
    if (opened) endpoint = std::move(*opened);
    endpoint->publish("telesplat_up 1\n");
  }
  std::string ask(const std::string& request) {
    Client c(port);
    c.say(request);
    return c.hear();
  }
  std::string get(const std::string& path) { return ask("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n"); }

  const int port = free_port();
  std::unique_ptr<HttpEndpoint> endpoint;
};

TEST_F(Endpoint, ServesTheNewestText) {
  const std::string answer = get("/metrics");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 OK\r\n")) << answer;
  EXPECT_NE(answer.find("text/plain; version=0.0.4"), std::string::npos);
  EXPECT_TRUE(answer.ends_with("\r\n\r\ntelesplat_up 1\n")) << answer;
  endpoint->publish(std::string(3 << 20, 'x') + "\n");
  EXPECT_GT(get("/metrics?a=b").size(), size_t(3 << 20));
  EXPECT_NE(get("/").find("/metrics has its figures"), std::string::npos);
  EXPECT_EQ(endpoint->url(), "http://127.0.0.1:" + std::to_string(port) + "/metrics");
}

TEST_F(Endpoint, RefusesWhatIsNotForIt) {
  EXPECT_TRUE(get("/other").starts_with("HTTP/1.1 404 "));
  EXPECT_TRUE(get("/metrics/../etc").starts_with("HTTP/1.1 404 "));
  EXPECT_TRUE(ask("POST /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n").starts_with("HTTP/1.1 405 "));
  EXPECT_TRUE(ask("POST /metrics HTTP/1.1\r\nHost: localhost\r\nContent-Length: 999999999\r\n\r\n")
                  .starts_with("HTTP/1.1 400 "))
      << "nobody waits for a body";
  EXPECT_TRUE(ask("no request at all\r\n\r\n").starts_with("HTTP/1.1 400 "));
  const std::string head = ask("HEAD /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(head.starts_with("HTTP/1.1 200 "));
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << head;
  EXPECT_TRUE(get("/metrics").ends_with("telesplat_up 1\n")) << "and goes on";
}

// A page in a browser of this machine may reach it by a name of its own that points here.
TEST_F(Endpoint, ThoseWhoCallItByAnotherNameAreRefused) {
  const auto code = [&](const std::string& head) {
    return ask("GET /metrics " + head + "\r\n\r\n").substr(0, sizeof "HTTP/1.1 200" - 1);
  };
  for (const char* host : {"localhost", "LocalHost:9464", "127.0.0.1", "127.3.2.1:80", "[::1]", "[::1]:9464"})
    EXPECT_EQ(code(std::string("HTTP/1.1\r\nHost: ") + host), "HTTP/1.1 200") << host;
  for (const char* host : {"evil.example", "evil.example:9464", "127.0.0.1.evil.example", "localhost.evil.example",
                           "192.168.1.5", "[fe80::1]:80", "::1", "[::1", "127.0.0.1@evil.example", "", ":80"})
    EXPECT_EQ(code(std::string("HTTP/1.1\r\nHost: ") + host), "HTTP/1.1 403") << host;
  EXPECT_EQ(code("HTTP/1.1\r\nHost: localhost\r\nHost: evil.example"), "HTTP/1.1 403");
  EXPECT_EQ(code("HTTP/1.1"), "HTTP/1.1 403");
  EXPECT_EQ(code("HTTP/1.0"), "HTTP/1.1 200") << "which knows no names";
}

TEST_F(Endpoint, RequestsWithoutAnEndAreNotKept) {
  EXPECT_EQ(ask("GET /metrics HTTP/1.1\r\nX: " + std::string(1 << 20, 'a')).find("200 OK"), std::string::npos);
  std::string headers = "GET /metrics HTTP/1.1\r\n";
  for (int i = 0; i < 100000; ++i) headers += "A: b\r\n";
  EXPECT_EQ(ask(headers).find("200 OK"), std::string::npos);
  EXPECT_TRUE(get("/metrics").ends_with("telesplat_up 1\n"));
}

// Many clients that send nothing, or a letter now and then, are closed when their time is over.
TEST_F(Endpoint, TheSlowAreClosedAndTheOthersServed) {
  std::vector<Client> slow;
  for (size_t i = 0; i < 2 * HttpEndpoint::kMostConnections; ++i) slow.emplace_back(port).say("GET /me");
  const double begin_s = monotonic_s();
  bool served = false;
  while (!served && monotonic_s() - begin_s < 4 * HttpEndpoint::kPatience_s) {
    Client c(port);
    c.say("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
    for (Client& s : slow) s.say("t");
    served = c.hear(1).ends_with("telesplat_up 1\n");
  }
  EXPECT_TRUE(served);
  for (Client& s : slow) {
    s.hear(5);
    EXPECT_TRUE(s.closed);
  }
}

TEST_F(Endpoint, APortInUseIsSaid) {
  const auto second = HttpEndpoint::open({.port = port});
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().text,
            "--metrics-port " + std::to_string(port) + ": 127.0.0.1 cannot be bound: Address already in use");
}

TEST(EndpointAddress, WhereOthersMayReachItAnyNameWill) {
  const int port = free_port();
  const auto opened = HttpEndpoint::open({.address = "0.0.0.0", .port = port, .insecure = true});
  ASSERT_TRUE(opened.ok());
  Client c(port);
  c.say("GET / HTTP/1.1\r\nHost: master\r\n\r\n");
  EXPECT_TRUE(c.hear().starts_with("HTTP/1.1 200 "));
}

TEST(EndpointAddress, IsLoopbackUnlessToldOtherwise) {
  for (const auto& [address, why] : {std::pair{"0.0.0.0", "needs --insecure"},
                                     {"::", "needs --insecure"},
                                     {"no-address", "is no IP address"},
                                     {"", "is no IP address"}}) {
    const auto refused = HttpEndpoint::open({.address = address, .port = free_port()});
    ASSERT_FALSE(refused.ok()) << address;
    EXPECT_NE(refused.error().text.find(why), std::string::npos) << refused.error().text;
  }
  EXPECT_TRUE(HttpEndpoint::open({.address = "0.0.0.0", .port = free_port(), .insecure = true}).ok());
  EXPECT_TRUE(HttpEndpoint::open({.address = "localhost", .port = free_port()}).ok());
}

}  // namespace
}  // namespace telesplat::master
