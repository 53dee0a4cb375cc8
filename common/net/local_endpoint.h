// Finds endpoints that stay on this machine.
#pragma once

#include <arpa/inet.h>

#include <algorithm>
#include <string>
#include <string_view>

namespace telesplat::net {

/// True for ipc, inproc, and tcp on a loopback address or localhost. False for names that only begin like one.
inline bool is_local(std::string_view endpoint) {
  if (endpoint.starts_with("ipc://") || endpoint.starts_with("inproc://")) return true;
  constexpr std::string_view kTcp = "tcp://";
  if (!endpoint.starts_with(kTcp)) return false;
  std::string host(endpoint.substr(kTcp.size()));
  host.resize(std::min(host.size(), host.rfind(':')));
  if (host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

/// Replaces localhost by 127.0.0.1: ZeroMQ binds only to addresses and interfaces.
inline std::string numeric_host(const std::string& endpoint) {
  constexpr std::string_view kLocal = "tcp://localhost:";
  return endpoint.starts_with(kLocal) ? "tcp://127.0.0.1:" + endpoint.substr(kLocal.size()) : endpoint;
}

/// True for tcp://[ADDRESS]:PORT, for which a socket needs ZeroMQ's IPv6 option.
inline bool is_ipv6(std::string_view endpoint) { return endpoint.starts_with("tcp://["); }

}  // namespace telesplat::net
