#include "common/net/keys/access.h"

namespace telesplat::net {

Result<Access> Access::open(Via via, const std::string& folder, const std::vector<Role>& roles, bool binds) {
  if (folder.empty() || folder == kNoKeys) return Access(std::move(via));
  auto keys = read_keys(folder, roles, binds);
  if (!keys) return Error{"--keys " + keys.error().text};
  return Access(std::move(via), *std::move(keys));
}

}  // namespace telesplat::net
