// Readers of single formats, which need no foreign library except decoders of pictures. `content` is the whole file;
// `name` appears in error texts. They guarantee sizes only (one array entry per vertex, three indices per triangle);
// read_mesh checks the rest of validate_mesh(). Faces of more than three corners are cut by cut_polygon().
#pragma once

#include <string>
#include <string_view>

#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"
#include "services/data/base/progress.h"
#include "services/data/base/random_mesh.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {

/// Reads PLY 1.0, ascii and both binary byte orders; polygons and triangle strips; nx ny nz; red green blue (also
/// diffuse_*) for vertices and faces; comments "TextureFile" with coordinates per vertex (s t, u v, texture_u
/// texture_v) or per corner (texcoord, texnumber), which are baked; other numbers of vertices and faces are arrays.
Result<Mesh> read_ply(std::string_view content, const std::string& name, const ReadProgress& progress,
                      Companions& companions, const std::string& array = {},
                      uint64_t texture_detail = kDefaultTextureDetail);
/// Finds the vertices and triangles of a binary PLY that has nothing but these, whose vertices have no lists, and whose
/// colours are bytes; reads the values of its arrays. Null: another PLY, or one with other polygons. name, array,
/// errors: as for read_ply().
Result<std::shared_ptr<const RandomMesh>> random_ply(const std::shared_ptr<const MappedFile>& file,
                                                     const std::string& name, const std::string& array = {});
/// Reads OFF in text, with the prefixes C (colours), N (normals), ST (texture coordinates, ignored); colours per face;
/// comments; CRLF. Error: binary files; the prefixes 4 and n, whose vertices do not have three coordinates.
Result<Mesh> read_off(std::string_view content, const std::string& name, const ReadProgress& progress);
/// Reads STL, binary or ascii; colours of facets as VisCAM and Materialise write them. Corners at the same position
/// become one vertex.
Result<Mesh> read_stl(std::string_view content, const std::string& name, const ReadProgress& progress);
/// True if the content is a text STL, or a binary one, whose header may begin like text.
bool is_text_stl(std::string_view content);
bool is_binary_stl(std::string_view content);
/// Reads Wavefront OBJ: v (with r g b too), vn, vt, f (negative indices too), usemtl with Kd and map_Kd of its material
/// libraries; textures are baked; continued lines. Lines, points, curves and free-form surfaces are left out, with a
/// note.
Result<Mesh> read_obj(std::string_view content, const std::string& name, const ReadProgress& progress,
                      Companions& companions, uint64_t texture_detail = kDefaultTextureDetail);

}  // namespace telesplat::data
