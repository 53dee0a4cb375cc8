// The chunk store: a mesh file, read once, split into spatial chunks in room space, kept on disk and memory-mapped.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "services/data/base/mesh.h"
#include "services/data/mesh/options.h"

namespace telesplat::data {

/// Error: a room size or an axis that nothing can be placed with.
Status validate(const StoreOptions& options);

struct MeshStoreInfo {
  std::string source;  ///< path of the file it was made from
  std::string format;  ///< "ply", "obj", ...
  uint64_t triangles = 0, vertices = 0;
  uint64_t degenerate_dropped = 0;
  bool had_normals = false, had_colours = false;
  std::vector<scene::ArrayInfo> arrays;  ///< that the file holds
  std::string array;                     ///< of which chunks have the values in place of colours; empty: none
  geometry::DBox box_data;               ///< as it is shown: the file's coordinates times coordinates.shown
  scene::Coordinates coordinates;
  geometry::Box box_room;
  std::string up;         ///< the axis chosen
  std::string up_reason;  ///< why, in a few words
  bool from_cache = false;
  uint64_t content_hash = 0;
  std::vector<std::string> notes;  ///< Mesh::notes; what else people should know of the store
};

/// An open chunk store: immutable, safe to read from any thread.
class MeshStore {
 public:
  /// Opens the store of `source`, making it first if the cache has none. path: of the file that the source reads, for
  /// errors and info(). Errors (exit code 2 for a user) name it. Precondition: validate(options).
  static Result<std::shared_ptr<MeshStore>> make(const std::string& path, const MeshSource& source,
                                                 const StoreOptions& options, const Progress& progress);
  virtual ~MeshStore() = default;

  virtual const MeshStoreInfo& info() const = 0;
  virtual const std::vector<geometry::ChunkInfo>& chunks() const = 0;
  /// Bytes of a chunk, in mapped memory. Precondition: id is one of chunks().
  virtual geometry::ChunkBytes chunk(ChunkId id) const = 0;
};

}  // namespace telesplat::data
