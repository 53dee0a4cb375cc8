#include "common/net/connections/greeting.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>

#include "common/core/descriptor.h"

namespace telesplat::net {
namespace {

// A greeting's signature and major version: the other side answers them with the rest of its own, and waits for ours.
constexpr std::string_view kBegin("\xff\0\0\0\0\0\0\0\1\x7f\3", 11);
constexpr size_t kMechanismAt = 12, kMechanismEnd = 32;

}  // namespace

std::string mechanism_at(const std::string& endpoint) {
  constexpr std::string_view kTcp = "tcp://";
  const size_t colon = endpoint.rfind(':');
  if (!endpoint.starts_with(kTcp) || colon <= kTcp.size()) return {};
  std::string host = endpoint.substr(kTcp.size(), colon - kTcp.size());
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host.c_str(), endpoint.c_str() + colon + 1, &wanted, &found) != 0) return {};
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
  const Descriptor fd(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval patience{0, 500'000};
  setsockopt(fd.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);  // limits connect(), too
  setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(fd.get(), found->ai_addr, found->ai_addrlen) != 0) return {};
  if (::send(fd.get(), kBegin.data(), kBegin.size(), MSG_NOSIGNAL) != ssize_t(kBegin.size())) return {};
  std::array<char, kMechanismEnd> greeting{};
  if (::recv(fd.get(), greeting.data(), greeting.size(), MSG_WAITALL) != ssize_t(greeting.size())) return {};
  if (std::memcmp(greeting.data(), kBegin.data(), 1) != 0) return {};
  const std::string_view mechanism(greeting.data() + kMechanismAt, kMechanismEnd - kMechanismAt);
  return std::string(mechanism.substr(0, mechanism.find('\0')));
}

Status check_loopback() {
  const Descriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const Descriptor caller(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET, address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t bytes = sizeof address;
  auto* const at = reinterpret_cast<sockaddr*>(&address);
  const bool connects = ::bind(listener.get(), at, bytes) == 0 && ::listen(listener.get(), 1) == 0 &&
                        ::getsockname(listener.get(), at, &bytes) == 0 &&
                        (::connect(caller.get(), at, bytes) == 0 || errno == EINPROGRESS);
  return connects ? ok_status() : Status(Error{std::strerror(errno)});
}

}  // namespace telesplat::net
