// A triangle mesh as the readers leave it: in the file's own coordinates, in double precision.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/box.h"
#include "common/scene/arrays.h"
#include "common/scene/placement.h"
#include "services/data/base/progress.h"

namespace telesplat::data {

inline constexpr uint64_t kMaxTriangles = uint64_t{1} << 31;
inline constexpr uint64_t kMaxVertices = (uint64_t{1} << 32) - 2;
inline constexpr uint32_t kNeutralAlbedo = 0xc8c8c8;  ///< the colour of data without colours
inline constexpr uint32_t kNoColour = ~uint32_t{0};   ///< of a triangle: its vertices keep theirs

struct Mesh {
  std::string format;                 ///< "ply", "obj", "stl", "off", "vtp", "vtu", "vtk", "gltf"
  std::vector<glm::dvec3> positions;  ///< in the file's units
  std::vector<glm::vec3> normals;     ///< empty, or one a vertex; of any length; (0, 0, 0): to be computed
  std::vector<uint32_t> colours;      ///< empty, or one a vertex: 0x00RRGGBB
  std::vector<uint32_t> indices;      ///< three a triangle
  /// The vertices that the last ones, in their order, stand beside for the sake of another colour. A mesh without
  /// normals is as smooth there as if they were one. double_vertices() adds them.
  std::vector<uint32_t> copy_of;
  /// The array that the reader was asked for: one value a vertex, or one a triangle where scalars_of_faces. Each is
  /// the file's minus scene::scalar_origin() of its span; NaN where that is not finite. Empty: it was asked for none.
  std::vector<float> scalars;
  bool scalars_of_faces = false;
  bool smooth = false;                   ///< sampled from a field: it has no creases, only coarse places
  std::vector<scene::ArrayInfo> arrays;  ///< all that the file holds, asked for or not; make_tellable() was called
  uint64_t degenerate_dropped = 0;       ///< faces with fewer than three corners
  std::vector<std::string> notes;        ///< what people should know of how it was read: lines that name the file
  /// What is placed in the room instead of the mesh's own box: of a surface, the grid of its volume, so that both stand
  /// at one place and are equally large.
  std::optional<geometry::DBox> frame;
  /// How positions are made from the file's coordinates, and what these are.
  scene::Coordinates coordinates;
};

/// What every reader promises and validate_mesh checks: at least one triangle, no more than kMaxTriangles, every index
/// below the number of vertices, every position finite, normals and colours absent or one a vertex. Errors start with
/// `name`.
Status validate_mesh(const Mesh& mesh, const std::string& name);

/// Drops triangles with corners that are not finite, and tells so in a note; such vertices move to (0, 0, 0). Returns
/// whether the mesh can be worked with: its indices and positions are as validate_mesh() wants them. Where no triangle
/// would be left, or an index is wrong, nothing is changed.
bool drop_not_finite(Mesh& mesh, const std::string& name);

/// Gives triangles one colour each: their vertices get it. Vertices between triangles of different colours are doubled,
/// with their normals and scalars.
/// of_triangles: one a triangle, 0x00RRGGBB or kNoColour. Precondition: every index is below the number of vertices.
void colour_faces(Mesh& mesh, std::span<const uint32_t> of_triangles);

/// 8-bit channels -> 0x00RRGGBB.
constexpr uint32_t pack_rgb(uint32_t r, uint32_t g, uint32_t b) { return r << 16 | g << 8 | b; }

struct MeshSource {
  uint64_t hash = 0;    ///< of the content of all files that it is read from
  std::string variant;  ///< what else decides what the mesh is, as part of a file name; often empty
  /// Reads it; what comes passed validate_mesh.
  std::function<Result<Mesh>(const ReadProgress&)> read;
  std::string array;  ///< what colours it, as scene::choose_array() takes it; part of the variant; empty: nothing
};

/// The hash of the files' contents, in this order. Files that cannot be read are left out: reading them says why. Calls
/// progress with stage kIdentifying.
uint64_t hash_files(const std::vector<std::string>& paths, const Progress& progress);

}  // namespace telesplat::data
