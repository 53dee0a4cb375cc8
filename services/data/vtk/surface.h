// Surfaces of data sets: what is seen of their cells from outside.
#pragma once

#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// Triangles of a data set.
struct Surface {
  std::vector<uint32_t> corners;  ///< three points of the data set a triangle
  std::vector<uint32_t> cells;    ///< whose data a triangle has
};

/// What people should know of cells that are not shown, or not as they are.
struct SurfaceNotes {
  uint64_t points_and_lines = 0, straightened = 0, ghosts = 0, unknown = 0;
};

/// The surfaces of data sets that make one whole, one each: their surface cells, and those faces of volume cells that
/// no second cell has. Faces are told apart by their points, between data sets by their points' positions. Faces of
/// volume cells look outward, however the cell is turned. A surface cell on a volume cell's outer face is shown once,
/// with its own data. Ghost cells (vtkGhostType: duplicates) cover others' faces, but are not shown; hidden and refined
/// cells, and those with hidden points, are not there. Error: a cell with too few points or with points that are not
/// there.
Result<std::vector<Surface>> surfaces_of(std::span<const DataSet> sets, SurfaceNotes& notes);

}  // namespace telesplat::data::vtk
