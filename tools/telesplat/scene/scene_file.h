// Scene files: TOML whose keys are flags of `telesplat run` and `telesplat view`.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/options/table.h"

namespace telesplat::launcher {

/// Reads a scene file into flags. Tables only group keys, except [packing], whose keys become --packing.KEY;
/// underscores become hyphens elsewhere; `file` is the scene itself, relative to the scene file's folder.
///   [scene]  file = "crater.ply"  up = "z"  room_size = 0.8      [view]  size = "2560x1600"  trajectory = "orbit"
/// A Julia set has kind = "julia" instead of a file; c may be an array, and the keys of [julia] are its parameters by
/// name, dotted or quoted (colour.by stands for colour, because TOML takes no value for a key that holds others):
///   [scene]  kind = "julia"  preset = "coral"  c = [0.1, 0.2, -0.4, -0.2]  animate = ["c.y=-0.4:0.4:10s"]
///   [julia]  iterations = 100  slice.offset = 0.1  palette = "ice"
///   [[keyframe]]  t = 0.0  c.y = -0.4          two at least of each parameter; they become --animate
/// A volume may have kind = "volume"; its files show its kind anyway. They, and those of tf, texture and trajectory,
/// lie beside the scene file:
///   [scene]  file = "head.nrrd"  tf = "skin"  lighting = false  data_servers = 2
///   [view]  wall = "2x1"  coupling = "loose"  buffers = 2
/// A scene file may be a stranger's: flags with a text in not_in_scene cannot be its keys.
/// Returns the flags with their values, then the data file or "julia". table: the flags of the command that reads it.
/// Errors name the file and the line or key; a key that is no flag is one.
Result<std::vector<std::string>> read_scene_file(const std::string& path, const options::Table& table);

/// Replaces an argument that names a .toml file by that file's flags. Flags on the command line win over those of the
/// file: --preset over all that makes a Julia set, --c over c and its components. arguments: those of a command that
/// takes a scene, without its name.
Result<std::vector<std::string>> expand_scene_file(std::vector<std::string> arguments, const options::Table& table);

}  // namespace telesplat::launcher
