// Unprojection of one row of a depth image into the octree's integer grid: leaf keys and positions inside leaves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/points/point_model.h"

namespace telesplat::points {

/// Key of a pixel without a point: an empty pixel, or one outside the octree's cube.
inline constexpr ClusterKey kNoCluster = 0xffffffffu;

/// A row's rays in grid units (1/65536 of a leaf's side, from the cube's low corner). The point at depth z (metres) of
/// pixel i has the grid coordinates
///   g[a] = origin[a] + z * (row[a] + (x_first + i) * step[a]),   z = depth_scale / code
/// in IEEE double precision, one operation after the other, no contraction: the same bits on every instruction set.
struct RowRays {
  std::array<double, 3> origin{}, row{}, step{};
  double depth_scale = 0;  ///< near_m * kMaxDepthCode
  double x_first = 0;      ///< the first pixel's centre, in pixels of the frame
  double limit = 0;        ///< the cube's side in grid units
};

/// The rays of row `y` of the frame, from pixel `x` on.
RowRays row_rays(const OctreeGrid& grid, const geometry::Camera& camera, int x, int y);

/// Returns for each of n depth codes its leaf's key, or kNoCluster if it is 0 or outside the cube, and the position in
/// the leaf (16 bits an axis; undefined without a key). Arrays of n elements each. SIMD, run-time dispatch.
void unproject_row(const RowRays& rays, const uint32_t* codes, size_t n, ClusterKey* keys,
                   const std::array<uint16_t*, 3>& positions);
/// The same without SIMD: the oracle for tests.
void unproject_row_scalar(const RowRays& rays, const uint32_t* codes, size_t n, ClusterKey* keys,
                          const std::array<uint16_t*, 3>& positions);

}  // namespace telesplat::points
