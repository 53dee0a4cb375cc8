// `telesplat inspect PATH`: what a data file, a run folder, a recorded frame, a depth image or a picture holds.
#pragma once

#include <string>

#include "services/data/mesh_store.h"

namespace telesplat::launcher {

/// Prints to stdout; exit code 0, or 2 with one line on stderr.
int inspect(const std::string& path, const data::MeshOptions& options);

}  // namespace telesplat::launcher
