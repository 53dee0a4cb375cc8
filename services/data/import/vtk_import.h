// The one place that talks to VTK.
#pragma once

#include <string>

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Reads a file of format "vtp", "vtu" or "vtk" with VTK's readers: polygons and strips of all blocks, the
/// outer faces of an unstructured grid; arrays, and the values of the one that `array` names
/// (empty: none); normals; colours from 8-bit or fractional RGB arrays. VTK may print, throw or crash on hostile
/// files: called in the program telesplat-import only.
Result<Mesh> import_with_vtk(const std::string& path, const std::string& format, const std::string& array);

}  // namespace telesplat::data
