// The proxies through which a process connects to others: a simulated link, or a real way out of a closed network.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::net {

/// SOCKS5 proxies, HOST:PORT, by the role of who is connected to; "": of all others. A process that connects to nothing
/// through a proxy has an empty one.
class Via {
 public:
  /// Of texts "HOST:PORT" or "ROLE=HOST:PORT". Error: which one is neither.
  static Result<Via> parse(const std::vector<std::string>& texts);

  /// The proxy toward this role; empty: none.
  std::string proxy(const std::string& role) const;

 private:
  std::map<std::string, std::string> proxies_;
};

}  // namespace telesplat::net
