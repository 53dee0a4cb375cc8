// What `telesplat inspect FILE` says of mesh and volume files.
#pragma once

#include <array>
#include <string>

#include "services/data/mesh/store.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {

struct MeshFileFacts {
  MeshStoreInfo info;
  uint64_t file_bytes = 0;
  size_t chunks = 0;
  uint64_t chunk_bytes = 0;  ///< of all chunks together
};

/// Opens the file's store (making it if need be: a file whose chunks cannot be made is no good file) and sums it up.
Result<MeshFileFacts> inspect_mesh(const std::string& path, const MeshOptions& options, const Progress& progress);

/// The facts as lines of text, each ended by a line feed: format, counts, box in the file's units and in the room, up,
/// normals, colours, chunks.
std::string describe(const MeshFileFacts& facts);

/// True if the file's content or name is that of a mesh format that open() reads; says nothing on whether it is sound.
bool is_mesh_file(const std::string& path);

struct VolumeFileFacts {
  VolumeSource source;
  Volume volume;                         ///< the first step
  uint64_t file_bytes = 0;               ///< of that step; a DICOM folder's files together
  std::array<uint64_t, 64> histogram{};  ///< voxels with values in 64 equal parts of [lo, hi]
};

/// Finds the volume, checks the headers of all its steps and reads the first. raw: as find_volume takes it.
Result<VolumeFileFacts> inspect_volume(const std::string& path, const std::string& raw, const ReadProgress& progress);

/// The facts as lines of text: format, size, type, spacing, axes, values, a histogram of them (bars by the logarithm of
/// counts), steps.
std::string describe(const VolumeFileFacts& facts);

}  // namespace telesplat::data
