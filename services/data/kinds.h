// What kind of scene a data set is, whether it may be opened, and opening it.
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

/// What data sets there are, for help texts: "mesh file (PLY, ...) or ..., volume (...), the word julia".
std::string scene_help();

/// What the options' scene is, by the options and by the file's content. Error, naming scene or flag: there is no such
/// file; it is a folder that holds nothing we know; an option is set that scenes of its kind do not have. Whether a
/// file is sound only opening it tells.
Result<scene::Kind> kind_of(const DataOptions& options);

/// Opens the scene, as what kind_of() says. Errors (exit code 2 for a user) name the file, or the parameter of a Julia
/// set.
Result<std::unique_ptr<Served>> open(const DataOptions& options, const Progress& progress);

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

/// Refuses files that lie elsewhere than below the folder of the file that names them (voxels of a detached header, for
/// one), links followed, unless options.companions is "anywhere": the writer of a file chose these names, and a server
/// that hands out what they lead to would hand out any file that it can read. What is missing, or cannot be read, is
/// for its reader to tell. Error: which file names which.
Status check_companions(const DataOptions& options);

}  // namespace telesplat::data
