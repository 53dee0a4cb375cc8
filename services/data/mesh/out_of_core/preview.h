// Makes a coarse form of a mesh from triangles that are spread over its file, in about a second, to be shown until its
// store is made.
#pragma once

#include <memory>
#include <string>

#include "services/data/base/random_mesh.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

struct PreviewOptions {
  StoreOptions store;
  std::string array;                  ///< MeshSource::array
  uint64_t most_triangles = 1 << 19;  ///< that are read
  double most_s = 0.5;                ///< for reading them, about; a 4096th of the mesh is read in any case
};

/// Returns a store of squares that cover the cells of a grid where triangles were found: surfels (surfels.h), with the
/// mesh's placement and box. Errors start with `path`: no triangle of those read is whole, no temporary file.
Result<std::shared_ptr<MeshStore>> make_preview(const std::string& path, const RandomMesh& mesh,
                                                const PreviewOptions& options);

/// Returns a store of a coarse mesh, such as that of a raster's every tenth sample. Errors start with `path`.
Result<std::shared_ptr<MeshStore>> keep_preview(const std::string& path, Mesh&& mesh, const StoreOptions& options);

}  // namespace telesplat::data
