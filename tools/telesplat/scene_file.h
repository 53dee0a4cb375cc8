// Scene files: TOML whose keys are flags of `telesplat run` and `telesplat view`.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Reads a scene file into flags. Tables group keys and leave no trace in the flag, except [packing], whose keys become
/// --packing.KEY; underscores become hyphens elsewhere; `file` is the scene itself, relative to the scene file's folder.
///   [scene]  file = "crater.ply"  up = "z"  room_size = 0.8      [view]  size = "2560x1600"  trajectory = "orbit"
/// Returns the flags with their values, then the data file. Errors name the file and the line or key.
Result<std::vector<std::string>> read_scene_file(const std::string& path);

/// Replaces an argument that names a .toml file by what is in it; flags on the command line win over those of the file.
Result<std::vector<std::string>> expand_scene_file(int argc, char** argv);

}  // namespace telesplat::launcher
