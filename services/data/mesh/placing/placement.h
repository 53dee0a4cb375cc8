// Places a mesh from its file's coordinates in room space (docs/architecture.md, "Room space"); makes missing normals.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "common/geometry/box.h"
#include "services/data/base/mesh.h"
#include "services/data/base/placement_options.h"

namespace telesplat::data {

struct SmoothNormals {
  std::vector<glm::vec3> normals;  ///< one per vertex, then one per copy; of any length
  std::vector<uint32_t> copies;    ///< vertices to be copied; the copies come after all vertices, in this order
};

/// Returns twice the triangle's area times its normal; double, so that every triangle with an area in float coordinates
/// keeps it. triangle: its three indices.
glm::dvec3 area_vector(const std::vector<glm::vec3>& positions, const uint32_t* triangle);

/// Returns each vertex's mean of its triangles' normals, weighted by area. Triangles around a vertex that meet at an
/// edge under less than crease_deg share one normal there; those parted by sharper edges, or that meet in the vertex
/// alone, have one each, and `indices` then refers to copies of the vertex. 180: each vertex has one normal.
///     The angle is that between the surfaces, for any winding; normals of turned triangles are turned before they are
/// added. A group has the sign of most of its area, so neighbours agree unless most triangles are turned.
/// The split by edges is that of VTK's vtkPolyDataNormals.
/// positions: of every vertex. indices: three per triangle; each triangle has an area.
SmoothNormals smooth_normals(const std::vector<glm::vec3>& positions, double crease_deg,
                             std::vector<uint32_t>& indices);

/// Turns, scales and moves a mesh from the file's coordinates into the room.
struct Placing {
  glm::dmat3 rotation{1.0};
  glm::dvec3 centre{0.0};  ///< in the file's coordinates: the room's origin
  double scale = 1;        ///< metres in the room per unit of the file
  bool smooth = false;     ///< normals are made without creases
  std::string up;          ///< x, y, z, -x, -y or -z
  std::string up_reason;   ///< reason, in a few words
  glm::vec3 room(const glm::dvec3& p) const { return glm::vec3(rotation * ((p - centre) * scale)); }
};

/// A mesh in room space, ready to be split. Every triangle has three different corners and an area above zero.
struct PlacedMesh {
  std::vector<glm::vec3> positions_room;
  std::vector<uint32_t> normals;       ///< encode_normal32, one per vertex
  std::vector<uint32_t> colours;       ///< 0x00RRGGBB, one per vertex; scalars: the bits of floats
  std::vector<uint32_t> face_colours;  ///< one per triangle, in place of `colours`, which is empty then; or empty
  bool scalars = false;
  std::vector<uint32_t> indices;  ///< three per triangle
  geometry::DBox box_data;        ///< box of the vertices that triangles use
  geometry::Box box_room;
  Placing placing;
  uint64_t degenerate_dropped = 0;
};

/// Guesses the data axis that points up, "y" or "z":
///   z for terrains: elevation rasters; or the box is less than 0.35 times as high in z as it is wide in x and y, and
///     the surface is an open height field in z (its area vector, the sum of all triangle normals times areas, is at
///     least 0.4 times the total area and within 30 degrees of z; over a closed surface that sum is zero);
///   z for coordinates of a map, and for clouds of points, PLY aside;
///   z for medical data: isosurfaces (most vertices have two coordinates, and only two, in common with many others,
///     because marching cubes puts them on the edges of a voxel grid), VTK's own formats, and surfaces of volumes;
///   y otherwise.
/// A guess: `up` overrides it. Precondition: validate_mesh passed.
struct UpGuess {
  std::string axis;
  std::string reason;  ///< in a few words, at most 60 bytes
};
UpGuess guess_up(const Mesh& mesh);

/// True for the surface of a scan: most vertices have two coordinates, and only two, in common with many others,
/// because marching cubes puts them on the edges of a voxel grid. Precondition: validate_mesh passed.
bool is_isosurface(const Mesh& mesh);

/// Centres the mesh's frame, or without one this box of the used vertices, at the origin, turns `up` ("auto":
/// guess_up) to +y and scales uniformly so that the largest extent of that box is room_size_m. The mesh itself is used
/// for guesses alone. Errors start with `name`: the box has no extent, or one beyond 1e30. Precondition: validate_mesh
/// passed.
Result<Placing> find_placing(const Mesh& mesh, const geometry::DBox& used, const PlacementOptions& options,
                             const std::string& name);

/// Brings a mesh, or a part of one, into the room; in double precision, rounded to float at the end. Drops degenerate
/// triangles and counts them. Makes missing normals, with copies of vertices on sharp edges (smooth_normals()) unless
/// the mesh is smooth; makes single normals without a direction, too. Takes the mesh apart as it goes to save memory.
/// No triangles are left if all are degenerate. Precondition: validate_mesh passed.
PlacedMesh place(Mesh&& mesh, const Placing& placing, double crease_deg);

/// Does both. Errors: those of find_placing(); no triangle is left.
Result<PlacedMesh> place_mesh(Mesh&& mesh, const PlacementOptions& options, const std::string& name);

}  // namespace telesplat::data
