#include "common/volume/grid.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace telesplat::volume {

double Grid::unit_m() const { return std::cbrt(std::abs(glm::determinant(glm::dmat3(index_to_room)))); }

geometry::Box Grid::box_room() const {
  geometry::DBox box;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](int axis) { return corner >> axis & 1 ? size[size_t(axis)] - 0.5 : -0.5; };
    box.extend(glm::dvec3(index_to_room * glm::dvec4(at(0), at(1), at(2), 1)));
  }
  return {glm::vec3(box.lo), glm::vec3(box.hi)};
}

glm::dvec3 Grid::centre_room() const {
  return index_to_room * glm::dvec4((size[0] - 1) / 2.0, (size[1] - 1) / 2.0, (size[2] - 1) / 2.0, 1);
}

Status validate(const Grid& grid) {
  for (const int n : grid.size)
    if (n < 1 || n > kMaxSide)
      return Error{fmt::format("a volume of {} x {} x {} voxels, limits 1 and {} on each axis", grid.size[0],
                               grid.size[1], grid.size[2], kMaxSide)};
  if (grid.voxels() > kMaxVoxels)
    return Error{fmt::format("a volume of {} voxels, limit {}", grid.voxels(), kMaxVoxels)};
  const glm::dmat4& m = grid.index_to_room;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r)
      if (!std::isfinite(m[c][r]) || std::abs(m[c][r]) > 1e9)
        return Error{fmt::format("the volume's placement has {} in row {}, column {}", m[c][r], r, c)};
  if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1)
    return Error{"the volume's placement is not affine"};
  // The inverse of a voxel much flatter than its sides would be inaccurate.
  const double sides = glm::length(glm::dvec3(m[0])) * glm::length(glm::dvec3(m[1])) * glm::length(glm::dvec3(m[2]));
  const double volume = std::abs(glm::determinant(glm::dmat3(m)));
  if (!(sides > 1e-30) || volume < 1e-3 * sides)
    return Error{
        fmt::format("the volume's voxels are flat: volume {} m^3 of sides whose product is {} m^3", volume, sides)};
  return ok_status();
}

}  // namespace telesplat::volume
