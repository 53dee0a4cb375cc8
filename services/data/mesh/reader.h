// Reading mesh files: one function a format, and one that finds out which.
#pragma once

#include <string>
#include <string_view>

#include "services/data/base/companions.h"
#include "services/data/base/elevation.h"
#include "services/data/base/mesh.h"
#include "services/data/base/progress.h"
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

/// What arrays of numbers a mesh file holds, with the ranges of their values. It is read for that, but kept nowhere.
/// Empty: of a format that has none, or a file without. Errors name the file.
Result<std::vector<scene::ArrayInfo>> mesh_arrays(const std::string& path, const ReadProgress& progress = {});
/// Whether files of this format can hold arrays.
bool has_arrays(std::string_view format);
/// Error: an array is named, but files of this format have none.
Status check_array(const std::string& array, const std::string& format, const std::string& path);

// The readers of single formats. `content` is the whole file, `name` stands in error texts. They promise what
// validate_mesh checks only as far as sizes go (arrays one a vertex, three indices a triangle); read_mesh checks the
// rest. Faces of more than three corners become fans around their first corner, which is right for convex ones.

/// PLY 1.0, ascii and both binary byte orders; polygons and triangle strips; nx ny nz; red green blue (also diffuse_*)
/// of vertices and faces; comments "TextureFile" with places of vertices (s t, u v, texture_u texture_v) or of corners
/// (texcoord, texnumber), which are baked; other numbers of vertices and faces are arrays.
Result<Mesh> read_ply(std::string_view content, const std::string& name, const ReadProgress& progress,
                      Companions& companions, const std::string& array = {},
                      uint64_t texture_detail = kDefaultTextureDetail);
/// OFF, text and binary, with the prefixes C (colours), N (normals), ST (texture coordinates, ignored); colours of
/// faces; comments; CRLF. Error: the prefixes 4 and n, whose vertices are not of three coordinates.
Result<Mesh> read_off(std::string_view content, const std::string& name, const ReadProgress& progress);
/// STL, binary or ascii; colours of facets as VisCAM and Materialise write them. Corners at the same position become
/// one vertex.
Result<Mesh> read_stl(std::string_view content, const std::string& name, const ReadProgress& progress);
/// Whether the content is an STL in text, and one in binary, whose header may begin like text.
bool is_text_stl(std::string_view content);
bool is_binary_stl(std::string_view content);
/// Wavefront OBJ: v (with r g b too), vn, vt, f (negative indices too), usemtl with Kd and map_Kd of its material
/// libraries; textures are baked; continued lines. Lines, points, curves and free-form surfaces are left out, with a
/// note.
Result<Mesh> read_obj(std::string_view content, const std::string& name, const ReadProgress& progress,
                      Companions& companions, uint64_t texture_detail = kDefaultTextureDetail);
/// VTK's files: vtk/reader.h. Files that it names are read from its folder.
Result<Mesh> read_vtk(std::string_view content, const std::string& path, const ReadProgress& progress,
                      const std::string& array = {});
/// glTF, as read_gltf() (gltf/reader.h), in the program telesplat-import, which must lie beside this process's own
/// program or in $PATH: a crash on a hostile file does not reach us.
Result<Mesh> read_imported_gltf(std::string_view content, const std::string& path, const ReadProgress& progress,
                                uint64_t texture_detail);

/// An elevation raster, through GDAL, in the program telesplat-import like the above; coloured and triangulated:
/// elevation.h.
Result<Mesh> read_with_gdal(std::string_view content, const std::string& path, const ElevationOptions& options,
                            const ReadProgress& progress);

/// Other files that `path` pulls in (material libraries of an OBJ and their textures, pictures of a PLY, buffers and
/// images of a glTF, files of a VRT, what says beside a raster where it lies), as paths; existing or not.
std::vector<std::string> companion_files(std::string_view content, const std::string& format, const std::string& path);
/// Of a VRT: the files that it is made of, as it names them.
std::vector<std::string> vrt_sources(std::string_view content);

}  // namespace telesplat::data
