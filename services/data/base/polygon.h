// Polygons of files, which need be neither convex nor flat, as triangles.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace telesplat::data {

/// Appends the triangles of a polygon to `indices`: three of `corners` each, in the polygon's own sense of rotation.
/// corners: indices into `positions`, all within. Convex polygons become fans around their first corner; others are cut
/// by ears in the plane of their area vector, which is right for every simple polygon. A polygon that crosses itself,
/// or has no area, still gives corners.size() - 2 triangles. Fewer than three corners: nothing is appended.
void cut_polygon(std::span<const uint32_t> corners, std::span<const glm::dvec3> positions,
                 std::vector<uint32_t>& indices);

}  // namespace telesplat::data
