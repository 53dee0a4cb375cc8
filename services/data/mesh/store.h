// The chunk store: a mesh file, read once, split into spatial chunks in room space, kept on disk and memory-mapped.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "services/data/base/elevation.h"

namespace telesplat::data {

struct MeshOptions {
  double room_size_m = 0.8;  ///< the largest extent of the data set's box in room space
  std::string up =
      "auto";  ///< x, y, z, -x, -y, -z: the data axis that points up; auto: z for terrains and medical data, else y
  std::string cache_dir;  ///< empty: $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat
  bool use_cache = true;
  ElevationOptions elevation;  ///< of elevation rasters alone
  std::optional<double> iso;   ///< of volumes alone: the surface where they have this value
  std::string raw;             ///< with iso: VolumeSource::raw
};

struct MeshStoreInfo {
  std::string source;  ///< path of the file it was made from
  std::string format;  ///< "ply", "obj", ...
  uint64_t triangles = 0, vertices = 0;
  uint64_t degenerate_dropped = 0;
  bool had_normals = false, had_colours = false;
  geometry::DBox box_data;  ///< in the file's own units
  geometry::Box box_room;
  std::string up;  ///< the axis chosen
  bool from_cache = false;
  uint64_t content_hash = 0;
};

/// stage: "hash", "read", "normals", "chunk", "write"; fraction 0..1.
using Progress = std::function<void(const char* stage, double fraction)>;

/// An open chunk store: immutable, safe to read from any thread.
class MeshStore {
 public:
  /// Opens the store of this mesh file, making it first if the cache has none. Errors (exit code 2 for a user) name the file.
  static Result<std::shared_ptr<MeshStore>> open(const std::string& path, const MeshOptions& options,
                                                 const Progress& progress);
  virtual ~MeshStore() = default;

  virtual const MeshStoreInfo& info() const = 0;
  virtual const std::vector<geometry::ChunkInfo>& chunks() const = 0;
  /// Bytes of a chunk, in mapped memory. Precondition: id is one of chunks().
  virtual geometry::ChunkBytes chunk(ChunkId id) const = 0;
};

}  // namespace telesplat::data
