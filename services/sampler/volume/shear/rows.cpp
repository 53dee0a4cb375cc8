#include "services/sampler/volume/shear/rows.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace telesplat::sampler {
namespace {

// Calls visit(j, k, begin, end) for each row along i that has voxels [begin, end).
template <class Visit>
void for_each_run(const volume::Grid& grid, const volume::Voxels& voxels, const Visit& visit) {
  size_t row = 0;
  for (int k = voxels.k_begin; k < voxels.k_end; ++k)
    for (int j = 0; j < grid.size[1]; ++j, ++row)
      if (voxels.rows[row] != voxels.rows[row + 1]) visit(j, k, voxels.rows[row], voxels.rows[row + 1]);
}

}  // namespace

ShearRows arrange(const volume::Grid& grid, const volume::Voxels& voxels, int axis) {
  ShearRows out;
  const int held = voxels.k_end - voxels.k_begin;
  const auto extent = [&](int of) { return of == 2 ? held : grid.size[size_t(of)]; };
  const auto start = [&](int of) { return of == 2 ? voxels.k_begin : 0; };
  out.slices = extent(axis), out.slice_begin = start(axis);
  out.rows = extent((axis + 2) % 3), out.row_begin = start((axis + 2) % 3);
  out.cells.resize(voxels.size());
  const bool lit = !voxels.normal.empty();
  const auto cell = [&](int u, uint32_t n) {
    return ShearCell{uint16_t(u), voxels.level[n], lit ? voxels.normal[n] : volume::kNoNormal};
  };
  if (axis == 2) {  // already in order
    out.first = voxels.rows;
    for (uint32_t n = 0; n < voxels.size(); ++n) out.cells[n] = cell(voxels.i[n], n);
  } else {
    // A row of axis 0 has one (i, k), with j in order; a row of axis 1 has one (j, i), with k in order. Voxels come in
    // order of (k, j, i), so that appending keeps columns in order.
    const auto row_of = [&](int i, int j, int k) {
      return axis == 0 ? size_t(i) * size_t(out.rows) + size_t(k - voxels.k_begin)
                       : size_t(j) * size_t(out.rows) + size_t(i);
    };
    out.first.assign(size_t(out.slices) * size_t(out.rows) + 1, 0);
    for_each_run(grid, voxels, [&](int j, int k, uint32_t begin, uint32_t end) {
      for (uint32_t n = begin; n < end; ++n) ++out.first[row_of(voxels.i[n], j, k) + 1];
    });
    for (size_t r = 1; r < out.first.size(); ++r) out.first[r] += out.first[r - 1];
    // first[r] moves on to the row's end while cells are put in place, and is put back by one afterwards.
    for_each_run(grid, voxels, [&](int j, int k, uint32_t begin, uint32_t end) {
      const int u = axis == 0 ? j : k;
      for (uint32_t n = begin; n < end; ++n) out.cells[out.first[row_of(voxels.i[n], j, k)]++] = cell(u, n);
    });
    for (size_t r = out.first.size() - 1; r > 0; --r) out.first[r] = out.first[r - 1];
    out.first[0] = 0;
  }
  out.bounds.resize(size_t(out.slices));
  for (int s = 0; s < out.slices; ++s) {
    ShearRows::Bounds& b = out.bounds[size_t(s)];
    for (int v = 0; v < out.rows; ++v) {
      const size_t r = size_t(s) * size_t(out.rows) + size_t(v);
      if (out.first[r] == out.first[r + 1]) continue;
      b.u_lo = std::min(b.u_lo, int(out.cells[out.first[r]].u));
      b.u_hi = std::max(b.u_hi, int(out.cells[out.first[r + 1] - 1].u));
      b.v_lo = std::min(b.v_lo, v + out.row_begin);
      b.v_hi = v + out.row_begin;
    }
  }
  return out;
}

// A voxel at (u, v, p) is kept by a plane if a[u] u + a[v] v + a[p] p >= least.
std::vector<KeptCells> kept_cells(const volume::Grid& grid, const ShearRows& rows, int axis,
                                  const geometry::Clip& clip) {
  struct Plane {
    double u, v, p, least;
  };
  const int of_u = (axis + 1) % 3, of_v = (axis + 2) % 3, last_u = grid.size[size_t(of_u)] - 1;
  std::vector<Plane> planes;
  for (const geometry::ClipPlane& plane : clip.planes) {
    const glm::dvec3 a = glm::transpose(glm::dmat3(grid.index_to_room)) * plane.normal;
    planes.push_back(
        {a[of_u], a[of_v], a[axis], plane.offset - glm::dot(plane.normal, glm::dvec3(grid.index_to_room[3]))});
  }
  std::vector<KeptCells> out(size_t(rows.slices) * size_t(rows.rows));
  for (int s = 0; s < rows.slices; ++s)
    for (int r = 0; r < rows.rows; ++r) {
      double lo = 0, hi = last_u;
      for (const Plane& plane : planes) {
        const double least = plane.least - plane.v * (rows.row_begin + r) - plane.p * (rows.slice_begin + s);
        if (std::abs(plane.u) < 1e-12)
          hi = least <= 0 ? hi : -1;
        else if (plane.u > 0)
          lo = std::max(lo, least / plane.u);
        else
          hi = std::min(hi, least / plane.u);
      }
      // The margin keeps voxels that lie in a plane, however they are rounded.
      lo = std::ceil(lo - 1e-6), hi = std::floor(hi + 1e-6);
      if (lo <= hi && hi >= 0) out[size_t(s) * size_t(rows.rows) + size_t(r)] = {uint16_t(lo), uint16_t(hi)};
    }
  return out;
}

}  // namespace telesplat::sampler
