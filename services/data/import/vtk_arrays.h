// The arrays of points and cells that VTK's data sets hold.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "services/data/base/mesh.h"

class vtkPolyData;

namespace telesplat::data {

/// Lists the surface's arrays of numbers in mesh.arrays, and puts the values of the one that `array` names (empty:
/// none) into mesh.scalars. cells: of which cell of the surface each triangle of the mesh is; needed where an array is
/// named. Error: no such array; begins with `path`. Precondition: the mesh holds this surface and nothing else.
Status take_arrays(vtkPolyData& surface, const std::string& array, std::span<const uint32_t> cells,
                   const std::string& path, Mesh& mesh);

}  // namespace telesplat::data
