// Surfaces of volumes, computed by VTK in the program telesplat-import: what both sides of the pipe must know.
#pragma once

#include <cstdint>
#include <string>

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// How a volume travels to the import program: this, then Volume::stored.
struct VolumeHeader {
  uint64_t magic = 0x314c4f5653545354;  // "TSTSVOL1"
  int32_t size[3] = {};
  int32_t type = 0;  ///< VoxelType
  double iso = 0;    ///< in stored values
  double index_to_data[16] = {};
};

/// The import program's part: reads header and voxels from the descriptor, which is a memory file. Error, starting with
/// `name`: they did not arrive whole; no surface, or too large a one.
Result<Mesh> flying_edges(int descriptor, const std::string& name);

}  // namespace telesplat::data
