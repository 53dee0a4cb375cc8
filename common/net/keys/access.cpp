#include "common/net/keys/access.h"

#include <fmt/format.h>

namespace telesplat::net {

Result<Access> Access::open(Via via, const std::string& folder, const std::vector<Role>& roles, bool binds) {
  if (folder.empty() || folder == kNoKeys) return Access(std::move(via));
  auto keys = read_keys(folder, roles, binds);
  if (!keys) return Error{"--keys " + keys.error().text};
  return Access(std::move(via), *std::move(keys));
}

Result<Via> Via::parse(const std::vector<std::string>& texts) {
  Via out;
  for (const auto& text : texts) {
    const size_t equals = text.find('='), colon = text.rfind(':');
    const size_t from = equals == text.npos ? 0 : equals + 1;
    const std::string port = colon == text.npos ? "" : text.substr(colon + 1);
    if (colon == text.npos || colon <= from || port.empty() || port.size() > 5 ||
        port.find_first_not_of("0123456789") != port.npos || port == "0")
      return Error{fmt::format("--via {}: is neither HOST:PORT nor ROLE=HOST:PORT of a SOCKS5 proxy", text)};
    out.proxies_[equals == text.npos ? "" : text.substr(0, equals)] = text.substr(from);
  }
  return out;
}

std::string Via::proxy(const std::string& role) const {
  auto found = proxies_.find(role);
  if (found == proxies_.end()) found = proxies_.find("");
  return found == proxies_.end() ? std::string() : found->second;
}

}  // namespace telesplat::net
