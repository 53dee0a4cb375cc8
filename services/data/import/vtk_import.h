// The one place that talks to VTK.
#pragma once

#include <string>

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Reads a file of format "vtp", "vtu", "vtk" or "gltf" with VTK's readers: polygons and strips of all blocks, the
/// outer faces of an unstructured grid, node transforms applied; arrays, and the values of the one that `array` names
/// (empty: none); normals; colours from 8-bit or fractional RGB arrays, from glTF materials (base colour factor times
/// base colour texture, baked as bake_textures() does, with at most `texture_detail` triangles). VTK may print, throw
/// or crash on hostile files: called in the program telesplat-import only.
Result<Mesh> import_with_vtk(const std::string& path, const std::string& format, const std::string& array,
                             uint64_t texture_detail);

}  // namespace telesplat::data
