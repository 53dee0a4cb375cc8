// The key that masters of tests seal their leases with.
#pragma once

#include "common/wire/lease_seal.h"

namespace telesplat::test {

inline const std::vector<uint32_t>& lease_key() {
  static const std::vector<uint32_t> key = wire::make_lease_key();
  return key;
}

/// Seals a lease as `master` does for `sampler`.
template <class L>
void seal_lease(L& lease, InstanceId sampler, InstanceId master = {1}) {
  lease.master = master;
  wire::seal(lease, sampler, lease_key());
}

}  // namespace telesplat::test
