// Frames a second of a mesh that is drawn where it is displayed: what table 7.1 calls "without remote visualization".
#pragma once

#include <string>

#include "common/core/result.h"
#include "tools/common/progress_line.h"

namespace telesplat::launcher {

/// Draws the mesh `frames` times along an orbit, a ray a pixel on all cores, in pictures of width x height, and writes
/// DIRECTORY/direct.json: fps (1 / median time), frame_ms of each. The first picture does not count. Error: the file
/// cannot be read or the folder not be written to, or Ctrl-C came.
Status measure_direct(const std::string& file, int width, int height, int frames, const std::string& directory,
                      tools::ProgressLine& progress);

}  // namespace telesplat::launcher
