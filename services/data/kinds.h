// Decides the kind of scene of a data set and whether it may be opened, and opens it.
#pragma once

#include <memory>
#include <string>

#include "common/core/result.h"
#include "common/scene/colouring.h"
#include "common/scene/kind.h"
#include "services/data/base/progress.h"
#include "services/data/data_options.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

class Served;

/// Returns the list of data sets for help texts: "mesh file (PLY, ...) or ..., volume (...), the word julia".
std::string scene_help();

/// Returns the kind of the options' scene, by the options and the file's content. Error, naming scene or flag: the file
/// does not exist; it is a folder without known files; an option is set that this kind does not have. A damaged file is
/// found only by opening it.
Result<scene::Kind> kind_of(const DataOptions& options);

/// Opens the scene as the kind that kind_of() returns. Errors (exit code 2 for a user) name the file, or the
/// parameter of a Julia set.
Result<std::unique_ptr<Served>> open(const DataOptions& options, const Progress& progress);

/// Opens the store of the mesh file or raster at `path`, or with options.iso that of the volume's surface; makes the
/// store first if the cache has none. progress may be empty. Errors (exit code 2 for a user) name the file.
Result<std::shared_ptr<MeshStore>> open_mesh(const std::string& path, const MeshOptions& options,
                                             const Progress& progress);
/// The same, but coloured by this array (empty: by none) instead of the options' one.
Result<std::shared_ptr<MeshStore>> open_mesh_by(const std::string& path, const MeshOptions& options,
                                                const std::string& array, const Progress& progress);

/// Returns the colouring of a mesh with these arrays; nullopt: by the file's own colours. Errors name flag or file.
Result<std::optional<scene::Colouring>> colouring_of(const MeshOptions& options, const MeshStoreInfo& mesh);
/// Returns the map of --colour-map. Error: names the flag.
Result<colour::ColourMap> colour_map_of(const MeshOptions& options);

/// Refuses data files that name files (voxels of a detached header, for example) outside of their own folder, links
/// followed, unless options.companions is "anywhere": the writer of the data file chose these names, and a server that
/// sends their content would send any file that it can read. Missing or unreadable files are left to their reader.
/// Error: names both files.
Status check_companions(const DataOptions& options);

}  // namespace telesplat::data
