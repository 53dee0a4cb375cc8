// What `telesplat inspect FILE` tells of data sets: found out by opening them as a run would.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "services/data/description.h"
#include "services/data/import/raster_facts.h"
#include "services/data/mesh/store.h"
#include "services/data/volume/store.h"

namespace telesplat::data {

struct MeshFileFacts {
  MeshStoreInfo info;
  uint64_t file_bytes = 0;
  size_t chunks = 0;
  uint64_t chunk_bytes = 0;           ///< of all chunks together
  std::optional<RasterFacts> raster;  ///< of elevation rasters
  std::string texture;                ///< draped over a raster; empty: none
  std::optional<double> iso;          ///< of surfaces of volumes
  std::string unit;                   ///< of lengths in the file: "mm", ...; empty: it does not say
};

/// Opens the file's store (making it if need be: a file whose chunks cannot be made is no good file) and sums it up.
Result<MeshFileFacts> inspect_mesh(const std::string& path, const MeshOptions& options, const Progress& progress);
/// Format, counts, what is in the file and what was computed, arrays, box in the file's units and in the room.
Description describe(const MeshFileFacts& facts);

/// The facts of a store of chunks itself, a file of the cache folder. Error: it is none, or damaged.
Result<MeshFileFacts> inspect_store(const std::string& path);

/// True if the file's content or name is that of a mesh format that open() reads; says nothing on whether it is sound.
bool is_mesh_file(const std::string& path);
/// Why a file is none: what it is instead, and what to do; empty: it is one, or cannot be read.
std::string why_no_mesh(const std::string& path);

struct VolumeFileFacts {
  std::string path;  ///< as it was asked for
  VolumeSource source;
  Volume volume;                         ///< the first step, without its voxels
  uint64_t file_bytes = 0;               ///< of all steps; a DICOM folder's files together
  uint64_t voxel_bytes = 0;              ///< of a step
  std::array<uint64_t, 64> histogram{};  ///< voxels of the first step with values in 64 equal parts of its range
  volume::Session session;               ///< what a run would begin with
  size_t steps_read = 1;                 ///< session.range.lo and hi are those of so many steps
  std::string up, up_reason;
  std::string transfer, transfer_reason;  ///< the transfer function's name, if it has one
  std::vector<std::string> arrays;        ///< of a file that names them
  std::vector<std::string> series;        ///< of a DICOM folder, as text_of() says
};

/// Finds the volume, checks the headers of all its steps and opens it. Errors: as those of VolumeStore::open.
Result<VolumeFileFacts> inspect_volume(const std::string& path, const VolumeOptions& options,
                                       const PlacementOptions& placement, const Progress& progress);
/// Format, size, type, spacing, axes, values, a histogram of them (bars by the logarithm of counts), steps, what a run
/// would choose.
Description describe(const VolumeFileFacts& facts);

}  // namespace telesplat::data
