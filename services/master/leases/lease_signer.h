// Puts the master's mark and seal on leases as they go out (common/wire/lease_seal.h).
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/wire/lease_seal.h"

namespace telesplat::master {

class LeaseSigner {
 public:
  /// instance_of: of the sampler with this routing id.
  LeaseSigner(InstanceId master, std::function<InstanceId(const std::string& sampler)> instance_of)
      : master_(master), instance_of_(std::move(instance_of)) {}

  /// L: wire::Lease or wire::SliceLease. sampler: the routing id of who gets it.
  template <class L>
  void sign(L& lease, const std::string& sampler) const {
    lease.master = master_;
    wire::seal(lease, instance_of_(sampler), key_);
  }
  /// For the packer.
  const std::vector<uint32_t>& key() const { return key_; }

 private:
  InstanceId master_;
  std::function<InstanceId(const std::string&)> instance_of_;
  std::vector<uint32_t> key_ = wire::make_lease_key();
};

}  // namespace telesplat::master
