// Reads mesh files: one function per format, and one that detects the format.
#pragma once

#include <string>
#include <string_view>

#include "services/data/base/elevation.h"
#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"
#include "services/data/base/progress.h"
#include "services/data/mesh/formats/readers.h"
#include "services/data/mesh/known_files.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {

/// A file's format, by its content first and its extension second: "ply", "obj", "stl", "off", "gltf", "raster", "las",
/// "ept", "e57", "pcd", "ptx", "xyz" (rows of text), a result of vtk::kind_of(), or "" with a sentence on its likely
/// kind (an image, a volume, an elevation raster) and on the supported formats.
struct DetectedFormat {
  std::string format;
  std::string complaint;
};
DetectedFormat detect_format(std::string_view content, const std::string& path);

/// Reads a mesh file of any supported format; the result has passed validate_mesh. Errors name the file. No memory is
/// allocated by a count that the file merely claims. elevation: for rasters only. array: colours the mesh, as for
/// scene::choose_array(); empty: no array.
/// texture_detail: for OBJ, PLY and glTF, whose textures are baked: bake_textures().
Result<Mesh> read_mesh(const std::string& path, const ReadProgress& progress, const ElevationOptions& elevation = {},
                       const std::string& array = {}, uint64_t texture_detail = kDefaultTextureDetail);

/// Returns the mesh file for a path: the file itself, the ept.json of a folder, or the first one of a folder that holds
/// only a numbered series of mesh files. steps: their number. Error: the folder holds no such series.
struct MeshFile {
  std::string path;
  size_t steps = 1;
};
Result<MeshFile> find_mesh_file(const std::string& path);

/// True if files of this format are clouds (services/data/cloud/readers.h).
bool is_cloud_format(std::string_view format);
/// True if files of this format can hold arrays.
bool has_arrays(std::string_view format);
/// Returns the paths of other files that `path` needs (material libraries of an OBJ and their textures, pictures of a
/// PLY, buffers and images of a glTF, files of a VRT, files that position a raster); they may not exist.
std::vector<std::string> companion_files(std::string_view content, const std::string& format, const std::string& path);
/// Returns the files that a VRT consists of, as it names them.
std::vector<std::string> vrt_sources(std::string_view content);

/// Returns the mesh file or raster at `path`, with its companions (material libraries, buffers, the texture), and
/// hashes them. Error, naming the file: it cannot be opened, is of no known format; elevation options are given for
/// another format, or an array for one without arrays. array: colours the mesh; empty: no array. texture_detail: for
/// OBJ and glTF, bake_textures().
Result<MeshSource> file_source(const std::string& path, const ElevationOptions& elevation, const std::string& array,
                               uint64_t texture_detail, const Progress& progress, const HashMemory& memory = {});

/// Returns the name of the active scalars of a VTP, VTU or legacy VTK file: of its points, else of its cells. Reads
/// only the file's words, not its arrays. Empty: it marks no array, or marks colours.
std::string active_array(std::string_view text);
/// The same for the file at `path`; empty also if it cannot be read or has another format.
std::string active_array_of(const std::string& path);

}  // namespace telesplat::data
