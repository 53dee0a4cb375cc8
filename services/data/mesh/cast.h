// Finds the first triangle of a store that a ray meets, and the value of its array there.
#pragma once

#include <optional>

#include "common/geometry/clip.h"
#include "common/scene/probe.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

/// Triangles have two sides. Reads only chunks whose boxes the ray meets, the nearest first. Values lie between
/// those of the triangle's corners; scalar_origin is added to the chunks' scalars (scene::Colouring::origin). of_cells:
/// each triangle has one value, so nothing is interpolated.
///
/// Bounds: coordinates and values in the store are rounded to 32-bit floats, and the data between the corners are not
/// known. A smooth surface through them deviates from the triangle by at most as much as the vertices around it do,
/// scaled by the square of their distance (the error of linear interpolation is h^2/8 times the second derivative);
/// neighbours behind a crease are ignored. nullopt: the ray meets no triangle that the clip keeps.
std::optional<scene::Probed> cast(const MeshStore& store, const scene::Probe& probe, const geometry::Clip& clip,
                                  double scalar_origin, bool of_cells);

}  // namespace telesplat::data
