#include "tools/wan_relay/options.h"

#include <fmt/format.h>

#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <tuple>
#include <utility>

namespace telesplat::wan_relay {
namespace {

// Splits "HOST:PORT"; an IPv6 address stands in brackets. "tcp://" in front and "*" for a free port are allowed.
Result<std::pair<std::string, std::string>> split(const char* flag, std::string text, bool to_listen) {
  const std::string given = text;
  if (text.starts_with("tcp://")) text.erase(0, 6);
  const size_t colon = text.rfind(':');
  if (colon == text.npos || colon == 0) return Error{fmt::format("{} {}: is not ADDRESS:PORT", flag, given)};
  std::string host = text.substr(0, colon), port = text.substr(colon + 1);
  if (host.starts_with("[") && host.ends_with("]")) host = host.substr(1, host.size() - 2);
  if (to_listen && port == "*") port = "0";
  unsigned number = 0;
  const auto [stop, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || stop != port.data() + port.size() || number > 65535 || (number == 0 && !to_listen))
    return Error{fmt::format("{} {}: the port is not in {}..65535{}", flag, given, to_listen ? 0 : 1,
                             to_listen ? ", nor * for a free one" : "")};
  return std::pair{host, port};
}

Result<Door> door(const char* flag, const std::string& listen, bool insecure) {
  const auto at = split(flag, listen, true);
  if (!at) return at.error();
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(at->first, error);
  if (error) return Error{fmt::format("{} {}: {} is no address such as 127.0.0.1", flag, listen, at->first)};
  if (!address.is_loopback() && !insecure)
    return Error{fmt::format("{} {}: is not a loopback address; others need --insecure", flag, listen)};
  return Door{at->first, at->second, {}, {}};
}

}  // namespace

options::Table table(Options& o) {
  return {{.flag = "--listen", .value = &o.listen, .help = "ADDRESS:PORT that takes connections; port *: a free one"},
          {.flag = "--to",
           .value = &o.to,
           .help = "ADDRESS:PORT that they are connected to: the first --to is that of the first --listen, and so on"},
          {.flag = "--socks",
           .value = &o.socks,
           .help = "ADDRESS:PORT that takes connections to where each asks for, by SOCKS5: what --via of Telesplat's "
                   "processes names"},
          {.flag = "--link",
           .value = &o.link_text,
           .help = "what the link is like, shared by all connections, each way: rtt=40ms,rate=100mbit,jitter=5ms,"
                   "stall=2s/30s (every 30 s nothing passes for 2 s); 50ms:100mbit; 20mbit; local"},
          {.flag = "--insecure", .value = &o.insecure, .help = "listen at addresses other than loopback"},
          {.flag = "--name", .value = &o.name, .help = "name in logs"},
          {.flag = "--log-level",
           .value = &o.log_level,
           .help = "trace, debug, info, warn, error or off",
           .limits = options::Names{"trace", "debug", "info", "warn", "error", "off"}}};
}

Status settle(Options& o) {
  const auto link = links::parse(o.link_text);
  if (!link) return Error{"--link " + link.error().text};
  o.link = *link;
  if (o.listen.size() != o.to.size())
    return Error{fmt::format("--listen is given {} times and --to {} times: each --listen needs its --to",
                             o.listen.size(), o.to.size())};
  if (o.listen.empty() && o.socks.empty())
    return Error{"nothing to listen at: --listen and --to, or --socks are needed"};
  for (size_t i = 0; i < o.listen.size(); ++i) {
    auto made = door("--listen", o.listen[i], o.insecure);
    if (!made) return made.error();
    const auto to = split("--to", o.to[i], false);
    if (!to) return to.error();
    std::tie(made->to_host, made->to_port) = *to;
    o.doors.push_back(std::move(*made));
  }
  for (const auto& listen : o.socks) {
    auto made = door("--socks", listen, o.insecure);
    if (!made) return made.error();
    o.doors.push_back(std::move(*made));
  }
  return ok_status();
}

}  // namespace telesplat::wan_relay
