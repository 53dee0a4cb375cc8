// Whatever is shown as a mesh: mesh files, elevation rasters, surfaces of volumes.
#pragma once

#include <memory>
#include <string>

#include "common/scene/colouring.h"
#include "services/data/mesh/options.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

/// Opens the store of the mesh file or raster at `path`, or with options.iso that of the volume's surface; makes it
/// first if the cache has none. progress may be empty. Errors (exit code 2 for a user) name the file.
Result<std::shared_ptr<MeshStore>> open_mesh(const std::string& path, const MeshOptions& options,
                                             const Progress& progress);
/// The same, but coloured by this array (empty: by none), whatever the options say.
Result<std::shared_ptr<MeshStore>> open_mesh_by(const std::string& path, const MeshOptions& options,
                                                const std::string& array, const Progress& progress);

/// How options colour a mesh with these arrays; nothing: by the file's own colours. Errors name flag or file.
Result<std::optional<scene::Colouring>> colouring_of(const MeshOptions& options, const MeshStoreInfo& mesh);
/// --colour-map as it was read. Error: names the flag.
Result<colour::ColourMap> colour_map_of(const MeshOptions& options);

}  // namespace telesplat::data
