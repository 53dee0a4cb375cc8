// Serves a volume from a data server: samplers ask for the voxels that the session's transfer function shows, and the
// master gets their number.
#pragma once

#include <memory>
#include <string>

#include "services/data/served.h"
#include "services/data/volume/store.h"

namespace telesplat::data {

/// The worker on requests: a thread of its own from begin() on, so that the serve loop keeps talking to the master; or
/// send_finished(), where threads are not allowed.
enum class VolumeWorker { kThread, kCaller };

/// path: the volume's. From begin() on only the worker uses the store.
std::unique_ptr<Served> serve_volume(std::shared_ptr<VolumeStore> store, const std::string& path,
                                     VolumeWorker worker = VolumeWorker::kThread);

}  // namespace telesplat::data
