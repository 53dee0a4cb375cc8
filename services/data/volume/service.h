// The data server of a volume: sends samplers the voxels that the session's transfer function shows, and the master how many those are.
#pragma once

#include "common/net/socket.h"
#include "services/data/data_service.h"

namespace telesplat::data {

/// Over an open store: binds, says hello, answers until told to stop; `stop` ends it, too. Exit code: 0, or 2 if nothing can be
/// bound.
int serve_volume(net::Context& context, VolumeStore& store, const DataServiceOptions& options,
                 const std::function<bool()>& stop);

}  // namespace telesplat::data
