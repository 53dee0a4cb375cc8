// Reading mesh files: one function a format, and one that finds out which.
#pragma once

#include <string>
#include <string_view>

#include "services/data/base/elevation.h"
#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"
#include "services/data/base/progress.h"
#include "services/data/mesh/formats/readers.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {

/// What a file is, by its content first and its extension second: "ply", "obj", "stl", "off", "gltf", "raster", what
/// vtk::kind_of() gives, or "" with a sentence on what it seems to be instead (an image, a volume, an elevation raster)
/// and what is supported.
struct DetectedFormat {
  std::string format;
  std::string complaint;
};
DetectedFormat detect_format(std::string_view content, const std::string& path);

/// Reads a mesh file of any supported format; what it returns passed validate_mesh. Errors name the file.
/// Nothing is allocated by a count that the file merely claims.
/// elevation: of rasters alone. array: what the mesh is coloured by, as scene::choose_array() takes it; empty: nothing.
/// texture_detail: of OBJ, PLY and glTF, whose textures are baked: bake_textures().
Result<Mesh> read_mesh(const std::string& path, const ReadProgress& progress, const ElevationOptions& elevation = {},
                       const std::string& array = {}, uint64_t texture_detail = kDefaultTextureDetail);

/// The mesh file that a path means: itself, or the first one of a folder with a numbered series of mesh files and no
/// others. steps: how many there are. Error: the folder holds no such series.
struct MeshFile {
  std::string path;
  size_t steps = 1;
};
Result<MeshFile> find_mesh_file(const std::string& path);

/// Whether files of this format can hold arrays.
bool has_arrays(std::string_view format);
/// Other files that `path` pulls in (material libraries of an OBJ and their textures, pictures of a PLY, buffers and
/// images of a glTF, files of a VRT, what says beside a raster where it lies), as paths; existing or not.
std::vector<std::string> companion_files(std::string_view content, const std::string& format, const std::string& path);
/// Returns the files that a VRT is made of, as it names them.
std::vector<std::string> vrt_sources(std::string_view content);

/// The mesh file or raster at `path`, with its companions (material libraries, buffers, the texture); hashes them.
/// Error, naming the file: it cannot be opened, is of no known format; elevation options are given for what is no
/// raster, or an array where the format has none. array: what the mesh is coloured by; empty: nothing. texture_detail:
/// of OBJ and glTF, bake_textures().
Result<MeshSource> file_source(const std::string& path, const ElevationOptions& elevation, const std::string& array,
                               uint64_t texture_detail, const Progress& progress);

/// Name of the active scalars of a VTP, VTU or legacy VTK file: of its points, else of its cells. Read from the file's
/// words alone, not its arrays. Empty: it marks none, or what it marks are colours.
std::string active_array(std::string_view text);
/// The same of the file at `path`; empty also where it cannot be read or is of another format.
std::string active_array_of(const std::string& path);

}  // namespace telesplat::data
