// From a file's own coordinates to room space (docs/architecture.md, "Room space").
#pragma once

#include <string>
#include <vector>

#include "common/geometry/box.h"
#include "services/data/base/mesh.h"
#include "services/data/base/placement_options.h"

namespace telesplat::data {

/// A mesh in room space, ready to be split. Every triangle has three different corners and an area above zero.
struct PlacedMesh {
  std::vector<glm::vec3> positions_room;
  std::vector<uint32_t> normals;  ///< encode_normal32, one a vertex
  std::vector<uint32_t> colours;  ///< 0x00RRGGBB, one a vertex; scalars: the bits of floats
  std::vector<uint32_t>
      face_colours;  ///< if there are some, one a triangle in place of colours, of which there are none
  bool scalars = false;
  std::vector<uint32_t> indices;  ///< three a triangle
  geometry::DBox box_data;        ///< of the vertices that triangles use
  geometry::Box box_room;
  std::string up;         ///< x, y, z, -x, -y or -z
  std::string up_reason;  ///< why, in a few words
  uint64_t degenerate_dropped = 0;
};

/// Which data axis points up, "y" or "z":
///   z for terrains: elevation rasters; or the box is less than 0.35 times as high in z as it is wide in x and y, and
///     the surface is an open height field in z (its area vector, the sum of all triangle normals times areas, is at
///     least 0.4 times the total area and within 30 degrees of z; over a closed surface that sum is zero);
///   z for medical data: isosurfaces (most vertices have two coordinates, and only two, in common with many others,
///     because marching cubes puts them on the edges of a voxel grid), VTK's own formats, and surfaces of volumes;
///   y otherwise.
/// A guess: `up` overrides it. Precondition: validate_mesh passed.
struct UpGuess {
  std::string axis;
  std::string reason;  ///< in a few words, at most 60 bytes
};
UpGuess guess_up(const Mesh& mesh);

/// Whether it is the surface of a scan: most vertices have two coordinates, and only two, in common with many others,
/// because marching cubes puts them on the edges of a voxel grid. Precondition: validate_mesh passed.
bool is_isosurface(const Mesh& mesh);

/// Centres the mesh's frame, or if it has none the box of the used vertices, at the origin, turns `up` ("auto":
/// guess_up) to +y and scales uniformly so that the largest extent of that box is room_size_m; all in double precision,
/// rounded to float at the end. Drops degenerate triangles and counts them. Where the file has no normals it makes
/// them, and copies of vertices that lie on sharp edges (creases.h), unless the mesh is smooth or an isosurface; where
/// one of the file's has no direction it makes that one. Takes the mesh apart as it goes to save memory. Errors start
/// with `name`: the box has no extent, or one beyond 1e30; no triangle is left. Precondition: validate_mesh passed.
Result<PlacedMesh> place_mesh(Mesh&& mesh, const PlacementOptions& options, const std::string& name);

}  // namespace telesplat::data
