// Cuts polygons of files, which need be neither convex nor flat, into triangles.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace telesplat::data {

/// Appends the triangles of a polygon to `cut`: three of 0 .. ring.size() - 1 each, in the polygon's own sense of
/// rotation. ring: indices into `positions`, all in range. Convex polygons become fans around their first corner;
/// others are cut by ears in the plane of their area vector, which is right for every simple polygon. A polygon that
/// crosses itself, or has no area, still gives ring.size() - 2 triangles; one of fewer than three corners gives none.
void cut_corners(std::span<const uint32_t> ring, std::span<const glm::dvec3> positions, std::vector<uint32_t>& cut);

/// The same, but appends elements of `ring`.
void cut_polygon(std::span<const uint32_t> ring, std::span<const glm::dvec3> positions, std::vector<uint32_t>& indices);

}  // namespace telesplat::data
