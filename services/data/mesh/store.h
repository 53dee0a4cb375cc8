// The chunk store: a mesh file, read once, split into spatial chunks in room space, kept on disk and memory-mapped.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "services/data/base/elevation.h"
#include "services/data/base/mesh.h"
#include "services/data/base/placement_options.h"
#include "services/data/base/volume.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {

struct PlacedMesh;

/// Settings that change a mesh's store.
struct StoreOptions : PlacementOptions {
  std::string cache_dir;  ///< empty: $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat
  bool use_cache = true;
  bool must_keep = false;  ///< error where the store cannot be kept, instead of going on without a cache
  /// Bytes of chunks, at most, that are checked when their store is opened; those of a larger store are checked when
  /// they are first used.
  uint64_t checked_at_opening = 256'000'000;
};

/// The colouring of a mesh, as users state it.
struct ColouringOptions {
  std::string by;               ///< scene::parse_colour_by(); empty: the file's own colours
  bool by_file = false;         ///< `by` is what the file marks; if unusable, the file's own colours count
  std::string map = "viridis";  ///< colour::resolve_colour_map()
};

/// Settings for reading, placing and storing a mesh.
struct MeshOptions : StoreOptions {
  ElevationOptions elevation;                       ///< for elevation rasters only
  uint64_t texture_detail = kDefaultTextureDetail;  ///< triangles, at most, of a mesh whose textures are baked
  ColouringOptions colouring;
  std::optional<double> iso;  ///< for volumes only: the surface where they have this value
  VolumeLayout volume;        ///< with iso
};

/// Figures as the store's file holds them, byte for byte.
struct MeshFigures {
  uint64_t content_hash = 0;
  uint64_t triangles = 0, vertices = 0;
  uint64_t degenerate_dropped = 0;
  uint32_t had_normals = 0, had_colours = 0;  ///< 1: the file has them
  geometry::DBox box_data;                    ///< box as shown: the file's coordinates times coordinates.shown
  geometry::Box box_room;
};

struct MeshStoreInfo : MeshFigures {
  std::string source;                    ///< path of the file that it was made from
  std::string format;                    ///< "ply", "obj", ...
  std::vector<scene::ArrayInfo> arrays;  ///< all arrays of the file
  std::string array;                     ///< the array whose values chunks hold in place of colours; empty: colours
  scene::Coordinates coordinates;
  std::string up;         ///< the axis that was chosen
  std::string up_reason;  ///< reason, in a few words
  bool from_cache = false;
  std::string kept_in;             ///< the store's file; empty: it has no name and goes with this process
  std::vector<std::string> notes;  ///< Mesh::notes, and other remarks on the store for users
};

/// An open chunk store: immutable, safe to read from any thread.
class MeshStore {
 public:
  /// Opens the store of `source`, making it first if the cache has none. path: the source's file, for errors and
  /// info(). Errors (exit code 2 for a user) name it. Precondition: options are within the limits of their flags.
  static Result<std::shared_ptr<MeshStore>> make(const std::string& path, const MeshSource& source,
                                                 const StoreOptions& options, const Progress& progress);
  /// True if make() would find the store of `source` in the cache.
  static bool is_made(const std::string& path, const MeshSource& source, const StoreOptions& options);
  /// Keeps a placed mesh in a file without a name, which goes away with its last mapping. Errors start with the path.
  static Result<std::shared_ptr<MeshStore>> keep(const std::string& path, const PlacedMesh& mesh,
                                                 const MeshStoreInfo& info);
  virtual ~MeshStore() = default;

  virtual const MeshStoreInfo& info() const = 0;
  /// All chunks: the leaves first, which hold the mesh, then the levels above them.
  virtual const std::vector<geometry::ChunkInfo>& chunks() const = 0;
  std::span<const geometry::ChunkInfo> leaves() const {
    const auto& all = chunks();
    return {all.begin(), std::find_if_not(all.begin(), all.end(), [](const auto& c) { return c.is_leaf(); })};
  }
  /// Returns a chunk, coded (geometry/chunk_code.h) and checked, in mapped memory. If it is damaged, removes its store
  /// and ends this process (end_at_damaged_file()): the next start makes the store anew. Precondition: id is one of
  /// chunks().
  virtual geometry::ChunkBytes chunk(ChunkId id) const = 0;
};

}  // namespace telesplat::data
