// `telesplat inspect PATH`: what a data file or volume folder, a run folder, a recorded frame, a depth image or a picture holds.
#pragma once

#include <string>

#include "services/data/mesh/store.h"

namespace telesplat::launcher {

/// `raw`: what --raw says of a raw volume; empty: files tell themselves. Prints to stdout; exit code 0, or 2 with one line on stderr.
int inspect(const std::string& path, const data::MeshOptions& options, const std::string& raw = "");

}  // namespace telesplat::launcher
