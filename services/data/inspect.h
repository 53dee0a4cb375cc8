// Describes data sets for `telesplat inspect FILE`, by opening them as a run would.
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
  size_t chunks = 0, coarse_chunks = 0, levels = 0;  ///< leaves; those above them; depth of the tree above the leaves
  uint64_t chunk_bytes = 0, coarse_bytes = 0;        ///< sums over leaves, and over those above
  std::optional<RasterFacts> raster;                 ///< elevation rasters only
  std::string texture;                               ///< draped over a raster; empty: no texture
  std::optional<double> iso;                         ///< surfaces of volumes only
  std::string unit;                                  ///< unit of lengths in the file: "mm", ...; empty: not given
};

/// Sums up the chunks of a store.
MeshFileFacts sum_up(const MeshStoreInfo& info, const std::vector<geometry::ChunkInfo>& chunks);
/// Opens the file's store (making it if needed: a file whose chunks cannot be made is not usable) and sums it up.
Result<MeshFileFacts> inspect_mesh(const std::string& path, const MeshOptions& options, const Progress& progress);
/// Describes format, counts, content of the file and computed values, arrays, box in the file's units and in the room.
Description describe(const MeshFileFacts& facts);

/// Returns the facts of a store of chunks, a file of the cache folder. Error: it is not a store, or damaged.
Result<MeshFileFacts> inspect_store(const std::string& path);

/// True if the file's content or name is that of a mesh format that open() reads; the file may still be damaged.
bool is_mesh_file(const std::string& path);
/// Returns why a file is not a mesh: what it is instead, and what to do; empty: it is a mesh, or cannot be read.
std::string why_no_mesh(const std::string& path);

struct VolumeFileFacts {
  std::string path;  ///< as the user gave it
  VolumeSource source;
  Volume volume;                         ///< the first step, without its voxels
  uint64_t file_bytes = 0;               ///< all steps together; a DICOM folder's files together
  uint64_t voxel_bytes = 0;              ///< per step
  std::array<uint64_t, 64> histogram{};  ///< first step: number of voxels in 64 equal parts of its range
  volume::Session session;               ///< as a run would begin
  size_t steps_read = 1;                 ///< number of steps from which session.range.lo and hi come
  std::string up, up_reason;
  std::string transfer, transfer_reason;  ///< the transfer function's name, if it has one
  std::vector<std::string> arrays;        ///< names of arrays, if the file has several
  std::vector<std::string> series;        ///< a DICOM folder's series, as text_of()
};

/// Finds the volume, checks the headers of all its steps and opens it. Errors: those of VolumeStore::open.
Result<VolumeFileFacts> inspect_volume(const std::string& path, const VolumeOptions& options,
                                       const PlacementOptions& placement, const Progress& progress);
/// Describes format, size, type, spacing, axes, values, their histogram (bars by the logarithm of counts), steps, and
/// the settings that a run would choose.
Description describe(const VolumeFileFacts& facts);

}  // namespace telesplat::data
