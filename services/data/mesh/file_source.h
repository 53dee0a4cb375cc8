// Mesh files and elevation rasters as what a store is made from.
#pragma once

#include <string>

#include "services/data/base/elevation_options.h"
#include "services/data/base/mesh_source.h"

namespace telesplat::data {

/// The mesh file or raster at `path`, with its companions (material libraries, buffers, the texture); hashes them.
/// Error, naming the file: it cannot be opened, is of no known format; elevation options are given for what is no
/// raster, or an array where the format has none. array: what the mesh is coloured by; empty: nothing. texture_detail:
/// of OBJ and glTF, bake_textures().
Result<MeshSource> file_source(const std::string& path, const ElevationOptions& elevation, const std::string& array,
                               uint64_t texture_detail, const Progress& progress);

}  // namespace telesplat::data
