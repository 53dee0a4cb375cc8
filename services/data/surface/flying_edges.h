// The surface where a field on a grid has one value.
#pragma once

#include "services/data/base/mesh.h"
#include "services/data/base/volume.h"

namespace telesplat::data {

/// Where the stored values of a volume are `iso`: one vertex on each grid edge that crosses it, linearly between the
/// edge's ends; triangles of marching cubes, which form closed surfaces but at the volume's border; normals from
/// central differences. All three in the volume's own units and axes; triangles and normals face lower values.
/// Voxels that are not finite count as `below`, in stored values. On all cores, in slabs of slices.
/// Source: W. Lorensen, H. Cline, "Marching cubes", SIGGRAPH 1987; what each slice and edge is for as in W. Schroeder,
/// R. Maynard, B. Geveci, "Flying edges", LDAV 2015.
/// Error, starting with `name`: more than kMaxTriangles or kMaxVertices.
Result<Mesh> flying_edges(const Volume& volume, double iso, double below, const std::string& name);

}  // namespace telesplat::data
