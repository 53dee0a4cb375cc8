#include "common/net/connections/tunnel.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <random>
#include <string_view>
#include <utility>

#include "common/core/clock.h"
#include "common/core/descriptor.h"

namespace telesplat::net {
namespace {

constexpr double kDial_s = 30;     // to reach the proxy, and from there the target
constexpr double kFarewell_s = 2;  // a closed socket with unsent messages connects within this time
constexpr size_t kBuffer = 1 << 16;
constexpr double kNoFiles_s = 0.1;  // wait until a descriptor may be free

struct Place {
  std::string host, port;
};

std::optional<Place> place_of(const std::string& text) {
  const size_t colon = text.rfind(':');
  if (colon == text.npos) return std::nullopt;
  std::string host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string port = text.substr(colon + 1);
  if (host.empty() || host.size() > 255 || port.empty() || port.size() > 5 ||
      port.find_first_not_of("0123456789") != port.npos || std::stoul(port) > 65535)
    return std::nullopt;
  return Place{host, port};
}

// SOCKS5 request (RFC 1928, section 4): CONNECT to an address, or to a name that the proxy looks up.
std::string request_for(const Place& target) {
  std::string out{5, 1, 0};
  std::array<char, 16> address{};
  if (inet_pton(AF_INET, target.host.c_str(), address.data()) == 1)
    out += '\1', out.append(address.data(), 4);
  else if (inet_pton(AF_INET6, target.host.c_str(), address.data()) == 1)
    out += '\4', out.append(address.data(), 16);
  else
    out += '\3', out += char(target.host.size()), out += target.host;
  const auto port = static_cast<uint16_t>(std::stoul(target.port));
  out += char(port >> 8), out += char(port & 0xff);
  return out;
}

// Same as look_after() for ZeroMQ's own connections: a peer that acknowledges nothing for patience_s is gone.
void watch_over(int fd, double patience_s) {
  constexpr int kIdle_s = 5, kApart_s = 5;
  const int options[][3]{{SOL_SOCKET, SO_KEEPALIVE, 1},
                         {IPPROTO_TCP, TCP_KEEPIDLE, kIdle_s},
                         {IPPROTO_TCP, TCP_KEEPINTVL, kApart_s},
                         {IPPROTO_TCP, TCP_KEEPCNT, std::max(1, int(patience_s - kIdle_s) / kApart_s)},
                         {IPPROTO_TCP, TCP_USER_TIMEOUT, int(patience_s * 1e3)}};
  for (const auto& [level, option, value] : options) setsockopt(fd, level, option, &value, sizeof value);
}

bool again(ssize_t n) { return n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR); }

/// One direction of a tunnel, with its buffer.
struct Way {
  Way(int source, int sink) : from(source), to(sink) {}
  const int from, to;
  std::array<char, kBuffer> bytes{};
  size_t begin = 0, end = 0;
  bool ended = false;  // the source sends no more

  bool empty() const { return begin == end; }
  bool over() const { return ended && empty(); }
  // False: the connection is broken.
  bool read() {
    const ssize_t n = ::recv(from, bytes.data(), bytes.size(), 0);
    if (again(n)) return true;
    if (n < 0) return false;
    begin = 0, end = size_t(n);
    ended = n == 0;
    return true;
  }
  bool write() {
    const ssize_t n = ::send(to, bytes.data() + begin, end - begin, MSG_NOSIGNAL);
    if (again(n)) return true;
    if (n <= 0) return false;
    begin += size_t(n);
    return true;
  }
};

}  // namespace

class Tunnel::Worker {
 public:
  Worker(Tunnel& tunnel, Descriptor listener, Place proxy, Place target, double patience_s)
      : tunnel_(tunnel),
        listener_(std::move(listener)),
        proxy_(std::move(proxy)),
        target_(std::move(target)),
        patience_s_(patience_s) {}

  void serve() {
    for (;;) {
      const Descriptor local = next();
      if (!local.valid()) break;
      const Descriptor remote = dial();
      if (remote.valid())
        pass(local.get(), remote.get());
      else
        ++tunnel_.failed_;  // counted before the socket notices
      if (tunnel_.retired_) break;
    }
    tunnel_.over_ = true;
  }

 private:
  // Waits for one of the descriptors, or for stop_. False: stop_, or the time is over.
  bool wait(std::array<pollfd, 2> of, double until_s) {
    for (;;) {
      const double left_s = until_s - monotonic_s();
      if (tunnel_.stop_ || left_s <= 0) return false;
      std::array<pollfd, 3> items{of[0], of[1], {tunnel_.woken_, POLLIN, 0}};
      ::poll(items.data(), items.size(), left_s > 1e6 ? -1 : int(left_s * 1e3) + 1);
      if (items[2].revents) {
        uint64_t count = 0;
        [[maybe_unused]] const ssize_t read = ::read(tunnel_.woken_, &count, sizeof count);
        return !tunnel_.stop_;  // it may be retired now
      }
      if (items[0].revents || items[1].revents) return true;
    }
  }
  bool wait(int fd, short events, double until_s) { return wait({{{fd, events, 0}, {-1, 0, 0}}}, until_s); }

  // Accepts the socket's next connection; none: the tunnel ends.
  Descriptor next() {
    std::optional<double> farewell_s;
    for (;;) {
      if (tunnel_.retired_ && !farewell_s) farewell_s = monotonic_s() + kFarewell_s;
      if (!wait(listener_.get(), POLLIN, farewell_s.value_or(1e300))) return Descriptor();
      Descriptor local(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      ucred who{};
      socklen_t size = sizeof who;
      if (!local.valid() && errno != EAGAIN) wait(-1, 0, monotonic_s() + kNoFiles_s);
      if (local.valid() && getsockopt(local.get(), SOL_SOCKET, SO_PEERCRED, &who, &size) == 0 && who.uid == geteuid())
        return local;
    }
  }

  Descriptor connected() {
    const double until_s = monotonic_s() + kDial_s;
    addrinfo wanted{}, *found = nullptr;
    wanted.ai_socktype = SOCK_STREAM;
    if (getaddrinfo(proxy_.host.c_str(), proxy_.port.c_str(), &wanted, &found) != 0) return Descriptor();
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
    for (const addrinfo* a = found; a; a = a->ai_next) {
      Descriptor fd(::socket(a->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
      if (!fd.valid()) continue;
      if (::connect(fd.get(), a->ai_addr, a->ai_addrlen) != 0) {
        int error = errno == EINPROGRESS ? 0 : errno;
        socklen_t size = sizeof error;
        if (error || !writable(fd.get(), until_s) || getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &error, &size) != 0 ||
            error)
          continue;
      }
      return fd;
    }
    return Descriptor();
  }
  bool writable(int fd, double until_s) {
    for (pollfd item{fd, POLLOUT, 0}; wait(fd, POLLOUT, until_s);)
      if (::poll(&item, 1, 0) > 0) return true;
    return false;
  }

  // Connects to the target, through the proxy.
  Descriptor dial() {
    Descriptor remote = connected();
    if (!remote.valid()) return remote;
    const int on = 1;
    setsockopt(remote.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    watch_over(remote.get(), patience_s_);
    const double until_s = monotonic_s() + kDial_s;
    const auto say = [&](std::string_view bytes) {
      return ::send(remote.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == ssize_t(bytes.size());
    };
    const auto hear = [&](size_t bytes) { return receive(remote.get(), bytes, until_s); };
    using namespace std::string_view_literals;
    if (!say("\5\1\0"sv) || hear(2) != "\5\0"sv || !say(request_for(target_))) return Descriptor();
    const std::string answer = hear(4);  // the address of the proxy follows, which is not needed
    if (answer.size() != 4 || answer[0] != 5 || answer[1] != 0) return Descriptor();
    const size_t length = answer[3] == 1 ? 4 : answer[3] == 4 ? 16 : 0;
    const std::string named = length ? "" : hear(1);
    const size_t rest = 2 + (length ? length : named.empty() ? 0 : static_cast<unsigned char>(named[0]));
    if (hear(rest).size() != rest) return Descriptor();
    return remote;
  }
  // Returns fewer bytes if the connection has ended or the time is over.
  std::string receive(int fd, size_t bytes, double until_s) {
    std::string out;
    while (out.size() < bytes && wait(fd, POLLIN, until_s)) {
      std::array<char, 256> piece{};
      const ssize_t n = ::recv(fd, piece.data(), std::min(piece.size(), bytes - out.size()), 0);
      if (again(n)) continue;
      if (n <= 0) break;
      out.append(piece.data(), size_t(n));
    }
    return out;
  }

  // Passes bytes until one end has ended, and the other has received all bytes of it.
  void pass(int local, int remote) {
    const auto out = std::make_unique<Way>(local, remote), in = std::make_unique<Way>(remote, local);
    const auto wanted = [](const Way& read, const Way& written) {
      return short((read.empty() && !read.ended ? POLLIN : 0) | (written.empty() ? 0 : POLLOUT));
    };
    while (!out->over() && !in->over()) {
      // Polls only ends with wanted events: otherwise one that has ended would wake this loop all the time.
      const short of_local = wanted(*out, *in), of_remote = wanted(*in, *out);
      if (!wait({{{of_local ? local : -1, of_local, 0}, {of_remote ? remote : -1, of_remote, 0}}}, 1e300)) return;
      for (Way* way : {out.get(), in.get()}) {
        if (way->empty() && !way->ended && !way->read()) return;
        if (!way->empty() && !way->write()) return;
      }
    }
    ::shutdown(remote, SHUT_WR);
  }

  Tunnel& tunnel_;
  const Descriptor listener_;
  const Place proxy_, target_;
  const double patience_s_;
};

Result<std::unique_ptr<Tunnel>> Tunnel::open(const std::string& proxy, const std::string& target, double patience_s) {
  auto by = place_of(proxy), to = place_of(target);
  if (!by || !to) return Error{fmt::format("{} through {}: is not HOST:PORT", target, proxy)};
  const auto refused = [&](const char* what) {
    return Error{fmt::format("{} through {}: {}: {}", target, proxy, what, std::strerror(errno))};
  };
  std::random_device random;
  const std::string name = fmt::format("telesplat-{}-{:08x}{:08x}", getpid(), random(), random());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, name.data(), name.size());  // in the namespace without files
  Descriptor listener(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const auto length = socklen_t(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (!listener.valid() || ::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), length) != 0 ||
      ::listen(listener.get(), 4) != 0)
    return refused("no socket");
  std::unique_ptr<Tunnel> out(new Tunnel);
  out->endpoint_ = "ipc://@" + name;
  out->woken_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (out->woken_ < 0) return refused("no eventfd");
  out->thread_ = std::thread(
      [worker = std::make_unique<Worker>(*out, std::move(listener), *by, *to, patience_s)] { worker->serve(); });
  return out;
}

Tunnel::~Tunnel() {
  stop_ = true;
  retire();
  if (thread_.joinable()) thread_.join();
  if (woken_ >= 0) ::close(woken_);
}

void Tunnel::retire() {
  retired_ = true;
  const uint64_t one = 1;
  if (woken_ < 0) return;
  [[maybe_unused]] const ssize_t written = ::write(woken_, &one, sizeof one);
}

}  // namespace telesplat::net
