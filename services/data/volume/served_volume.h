// A volume as a data server serves it: samplers ask for the voxels that the session's transfer function shows, the
// master is told how many those are.
#pragma once

#include <memory>
#include <string>

#include "services/data/served.h"
#include "services/data/volume/store.h"

namespace telesplat::data {

/// path: where the volume is from. From begin() on a thread of its own uses the store.
std::unique_ptr<Served> serve_volume(std::shared_ptr<VolumeStore> store, const std::string& path);

}  // namespace telesplat::data
