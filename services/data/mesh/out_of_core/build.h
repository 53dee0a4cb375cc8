// Makes the store of a mesh that is never in memory as a whole: surveys its file, divides its triangles into parts
// (partition.h), and splits one part after the other into leaves.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/data/base/random_mesh.h"
#include "services/data/mesh/placing/placement.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

/// Findings of the first look at all triangles.
struct Survey {
  geometry::DBox box_data;           ///< box of the vertices that triangles use
  uint64_t triangles = 0;            ///< found, whole or not
  uint64_t not_finite = 0;           ///< triangles with such a corner
  std::vector<glm::vec3> centroids;  ///< about a million, of triangles that are spread over the file
};

/// Looks at all triangles. nullopt: one of them has more or fewer corners. Errors as validate_mesh(), starting with
/// `name`.
Result<std::optional<Survey>> survey(const RandomMesh& mesh, const std::string& name, const ReadProgress& progress);

/// Returns a few vertices and triangles, spread over the file, to guess by (find_placing()).
Mesh spread_sample(const RandomMesh& mesh);

/// Returns a remark without the file's name before it, as stores hold it.
std::string without_name(const std::string& note, const std::string& path);

/// Where a store is made: an open, empty, writable file, and a folder with room for four bytes a triangle meanwhile.
struct StorePlace {
  int descriptor;
  std::string folder;
  bool unwritten = false;  ///< set to true if something could not be written
};

struct OutOfCoreOptions {
  StoreOptions store;
  uint64_t memory_bytes = uint64_t{2} << 30;  ///< taken by what is being made, about
  size_t leaf_triangles = 1 << 16;            ///< in a chunk, at most
  size_t leaves = 16;                         ///< in a part: a power of four
};

/// Writes the store, and completes `info`, whose content_hash and array are known. The leaves have the triangles of
/// write_store()'s, normals and colours included, but end at other places. False: the mesh must be read whole: its
/// triangles lie across each other, or not all are triangles. Errors start with `path`.
Result<bool> write_out_of_core(StorePlace& place, const std::string& path, const RandomMesh& mesh,
                               const OutOfCoreOptions& options, MeshStoreInfo& info, const Progress& progress);

}  // namespace telesplat::data
