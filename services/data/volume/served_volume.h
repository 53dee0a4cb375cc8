// A volume as a data server serves it: samplers ask for the voxels that the session's transfer function shows, the
// master is told how many those are.
#pragma once

#include <memory>
#include <string>

#include "services/data/served.h"
#include "services/data/volume/store.h"

namespace telesplat::data {

/// Who works off what is asked for: a thread of its own from begin() on, so that the serve loop keeps talking to the
/// master meanwhile; or send_finished(), where no thread may be.
enum class VolumeWorker { kThread, kCaller };

/// path: where the volume is from. From begin() on the worker uses the store.
std::unique_ptr<Served> serve_volume(std::shared_ptr<VolumeStore> store, const std::string& path,
                                     VolumeWorker worker = VolumeWorker::kThread);

}  // namespace telesplat::data
