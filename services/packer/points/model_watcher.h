// Who wants to know what happens to the packer's model.
#pragma once

#include <span>

#include "common/points/point_model.h"

namespace telesplat::packer {

class ModelWatcher {
 public:
  virtual ~ModelWatcher() = default;
  /// Before the patch goes in.
  virtual void inserted(const points::PreparedPatch& patch) = 0;
  /// Clusters, or patches of them, were dropped.
  virtual void forgotten(std::span<const points::ClusterKey> clusters) = 0;
  /// Everything was dropped: a new epoch.
  virtual void cleared() = 0;
};

}  // namespace telesplat::packer
