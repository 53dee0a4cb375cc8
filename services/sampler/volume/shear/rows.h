// The voxels of a slab, arranged for one principal axis: cells of one slice and row lie together, in the order of the
// raster's columns.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/clip.h"
#include "common/volume/grid.h"
#include "common/volume/voxels.h"

namespace telesplat::sampler {

struct ShearCell {
  uint16_t u;  ///< index along ShearFrame::u()
  uint16_t level, normal;
};

struct ShearRows {
  int slice_begin = 0, slices = 0;  ///< slices along p that are held: [slice_begin, slice_begin + slices)
  int row_begin = 0, rows = 0;      ///< rows along v that are held
  /// Row v of slice s has the cells [first[r], first[r + 1]), r = (s - slice_begin) * rows + (v - row_begin).
  std::vector<uint32_t> first;
  std::vector<ShearCell> cells;
  /// Bounds of a slice's cells: u in [u_lo, u_hi], v in [v_lo, v_hi]; u_lo > u_hi: it has no cells.
  struct Bounds {
    int u_lo = 65536, u_hi = -1, v_lo = 65536, v_hi = -1;
  };
  std::vector<Bounds> bounds;  ///< one for each held slice
};

/// The part of a row that is kept: u in [first, last].
struct KeptCells {
  uint16_t first = 1, last = 0;
};
/// Returns the kept part of each row of `rows`, in their order: voxels whose centres the clip keeps.
std::vector<KeptCells> kept_cells(const volume::Grid& grid, const ShearRows& rows, int axis,
                                  const geometry::Clip& clip);

/// Arranges voxels by counting: O(voxels + rows). axis: the principal axis.
ShearRows arrange(const volume::Grid& grid, const volume::Voxels& voxels, int axis);

}  // namespace telesplat::sampler
