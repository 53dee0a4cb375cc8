// Normals of meshes whose files have none: smooth over curved parts, and split where a surface has an edge.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace telesplat::data {

struct SmoothNormals {
  std::vector<glm::vec3> normals;  ///< one a vertex, then one for each copy; of any length
  std::vector<uint32_t> copies;    ///< vertices to be copied; the copies come after all vertices, in this order
};

/// Twice the triangle's area times its normal; double, so that no triangle that has an area in float coordinates loses
/// it. triangle: its three indices.
glm::dvec3 area_vector(const std::vector<glm::vec3>& positions, const uint32_t* triangle);

/// Each vertex's mean of its triangles' normals, weighted by area. Triangles around a vertex that meet at an edge under
/// less than crease_deg have one normal there; those that are parted by sharper edges, or meet in the vertex alone,
/// have one each, and `indices` refers to copies of the vertex for them. 180: each vertex has one normal.
///   The angle is that between the surfaces, however the triangles are wound; normals of turned ones are turned before
///   they are added. A group has the sign of most of its area, so neighbours agree unless most triangles are turned.
/// The split by edges is that of VTK's vtkPolyDataNormals.
/// positions: of every vertex. indices: three a triangle; each triangle has an area.
SmoothNormals smooth_normals(const std::vector<glm::vec3>& positions, double crease_deg,
                             std::vector<uint32_t>& indices);

}  // namespace telesplat::data
