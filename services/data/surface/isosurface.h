// Makes isosurfaces of volumes (T7.2: skull, bone, skin), as meshes.
#pragma once

#include "services/data/base/mesh.h"
#include "services/data/base/volume.h"
#include "services/data/mesh/known_files.h"

namespace telesplat::data {

/// Returns the surface where the volume has the value `iso`: flying_edges(). Positions are in the volume's own units
/// and axes; the volume's box is the mesh's frame. Normals come from gradients and point to lower values. The surface
/// is open at the volume's border. Error, starting with `name`: iso is not inside the values; no triangle, or too many.
Result<Mesh> isosurface(const Volume& volume, double iso, const std::string& name);

/// Returns that surface of the volume at `path` (its first step), for a store of chunks. Error: as find_volume.
Result<MeshSource> surface_source(const std::string& path, const VolumeLayout& layout, double iso,
                                  const Progress& progress, const HashMemory& memory);

/// Makes the surface where a volume's stored values are `iso`: one vertex on each grid edge that crosses it, linearly
/// between the edge's ends; triangles of marching cubes, which form closed surfaces except at the volume's border;
/// normals from central differences. All three in the volume's own units and axes; triangles and normals face lower
/// values. Voxels that are not finite count as `below`, in stored values. On all cores, in slabs of slices. Source: W.
/// Lorensen, H. Cline, "Marching cubes", SIGGRAPH 1987; roles of slices and edges as in W. Schroeder, R. Maynard, B.
/// Geveci, "Flying edges", LDAV 2015.
/// Error, starting with `name`: more than kMaxTriangles or kMaxVertices.
Result<Mesh> flying_edges(const Volume& volume, double iso, double below, const std::string& name);

}  // namespace telesplat::data
