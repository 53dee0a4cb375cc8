#include "common/net/connections/greeting.h"

#include <netdb.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>

#include "common/core/descriptor.h"

namespace telesplat::net {
namespace {

// A greeting's signature and major version: the other side sends the rest of its own for them, and waits for ours.
constexpr std::string_view kBegin("\xff\0\0\0\0\0\0\0\1\x7f\3", 11);
constexpr size_t kMechanismAt = 12, kMechanismEnd = 32;

constexpr std::string_view kTcp = "tcp://";

// Error: the system's words.
Result<Descriptor> connect_to(const std::string& endpoint) {
  const size_t colon = endpoint.rfind(':');
  if (!endpoint.starts_with(kTcp) || colon <= kTcp.size()) return Error{endpoint + " is no tcp://HOST:PORT"};
  std::string host = endpoint.substr(kTcp.size(), colon - kTcp.size());
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_socktype = SOCK_STREAM;
  if (const int failed = getaddrinfo(host.c_str(), endpoint.c_str() + colon + 1, &wanted, &found))
    return Error{gai_strerror(failed)};
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
  Descriptor fd(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval patience{0, 500'000};
  setsockopt(fd.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);  // of connect(), too
  setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(fd.get(), found->ai_addr, found->ai_addrlen) != 0) return Error{std::strerror(errno)};
  return fd;
}

}  // namespace

Status check_reachable(const std::string& endpoint) {
  if (!endpoint.starts_with(kTcp)) return ok_status();
  const auto fd = connect_to(endpoint);
  return fd ? ok_status() : Status(fd.error());
}

std::string mechanism_at(const std::string& endpoint) {
  const auto fd = connect_to(endpoint);
  if (!fd) return {};
  if (::send(fd->get(), kBegin.data(), kBegin.size(), MSG_NOSIGNAL) != ssize_t(kBegin.size())) return {};
  std::array<char, kMechanismEnd> greeting{};
  if (::recv(fd->get(), greeting.data(), greeting.size(), MSG_WAITALL) != ssize_t(greeting.size())) return {};
  if (std::memcmp(greeting.data(), kBegin.data(), 1) != 0) return {};
  const std::string_view mechanism(greeting.data() + kMechanismAt, kMechanismEnd - kMechanismAt);
  return std::string(mechanism.substr(0, mechanism.find('\0')));
}

}  // namespace telesplat::net
