// The flags of telesplat-wan-relay.
#pragma once

#include <string>
#include <vector>

#include "common/links/link.h"
#include "common/options/table.h"

namespace telesplat::wan_relay {

/// A place to listen at, and the target of its connections.
struct Door {
  std::string host;              ///< a numeric address
  std::string port;              ///< "0": a free one
  std::string to_host, to_port;  ///< empty: the client names it, by SOCKS5
};

struct Options {
  std::vector<std::string> listen, to, socks;  ///< as given
  std::string link_text = "local";
  bool insecure = false;
  std::string name = "wan-relay", log_level = "info";
  std::vector<Door> doors;  ///< made of listen, to and socks
  links::Link link;
};

options::Table table(Options& options);
/// Makes doors and link of the texts. Error: names the flag, its value and what is wrong.
Status settle(Options& options);

}  // namespace telesplat::wan_relay
