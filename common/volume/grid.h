// A regular grid of voxels in the room: any affine placement, so spacing may differ by axis, and axes need not be the
// room's.
#pragma once

#include <array>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::volume {

inline constexpr int kMaxSide = 4096;               ///< voxels along an axis
inline constexpr uint64_t kMaxVoxels = 1ull << 34;  ///< voxels of a grid

/// Voxel (i, j, k) has its centre at index coordinates (i, j, k). The field is interpolated between centres; beyond the
/// outermost ones it falls to zero over one more voxel, so that the grid's box is [-1, n] on each axis.
struct Grid {
  std::array<int, 3> size{1, 1, 1};
  glm::dmat4 index_to_room{1.0};  ///< affine: room = index_to_room * (i, j, k, 1), metres

  bool operator==(const Grid&) const = default;

  uint64_t voxels() const { return uint64_t(size[0]) * uint64_t(size[1]) * uint64_t(size[2]); }
  glm::dmat4 room_to_index() const { return glm::inverse(index_to_room); }
  /// The unit of length for opacity in transfer functions: the cube root of a voxel's volume, metres.
  double unit_m() const;
  /// The smallest box in room space that holds [-0.5, n - 0.5] on every axis.
  geometry::Box box_room() const;
  /// Centre of the box, room space.
  glm::dvec3 centre_room() const;
};

/// Refuses sizes outside [1, kMaxSide], more than kMaxVoxels, placements that are not finite, not affine, or (nearly)
/// flat.
Status validate(const Grid& grid);

}  // namespace telesplat::volume
