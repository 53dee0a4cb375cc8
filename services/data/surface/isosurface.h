// Isosurfaces of volumes (T7.2: skull, bone, skin), as meshes.
#pragma once

#include "services/data/base/mesh_source.h"
#include "services/data/base/volume.h"
#include "services/data/base/volume_layout.h"

namespace telesplat::data {

/// The surface where the volume has the value `iso`: flying_edges.h. Positions are in the volume's own units and axes,
/// and the volume's box is the mesh's frame. Normals come from gradients and point to lower values. The volume's border
/// stays open. Error, starting with `name`: iso is not inside the values, no triangle, too many of them.
Result<Mesh> isosurface(const Volume& volume, double iso, const std::string& name);

/// That surface of the volume at `path` (its first step), for a store of chunks. Error: as find_volume.
Result<MeshSource> surface_source(const std::string& path, const VolumeLayout& layout, double iso,
                                  const Progress& progress);

}  // namespace telesplat::data
