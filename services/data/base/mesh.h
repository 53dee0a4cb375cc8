// A triangle mesh as readers return it: in the file's own coordinates, in double precision.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/box.h"
#include "common/scene/arrays.h"
#include "common/scene/placement.h"
#include "services/data/base/progress.h"
#include "services/data/base/random_mesh.h"

namespace telesplat::data {

inline constexpr uint64_t kMaxTriangles = uint64_t{1} << 31;
inline constexpr uint64_t kMaxVertices = (uint64_t{1} << 32) - 2;
inline constexpr uint32_t kNeutralAlbedo = 0xc8c8c8;  ///< the colour of data without colours
inline constexpr uint32_t kNoColour = ~uint32_t{0};   ///< a triangle without a colour: its vertices keep theirs

struct Mesh {
  std::string format;  ///< "ply", "obj", "stl", "off", "vtp", "vtu", "vtk", "gltf"; of clouds "... points"
  std::vector<glm::dvec3> positions;  ///< in the file's units
  std::vector<glm::vec3> normals;     ///< empty, or one per vertex; of any length; (0, 0, 0): to be computed
  std::vector<uint32_t> colours;      ///< empty, or one per vertex: 0x00RRGGBB
  std::vector<uint32_t> indices;      ///< three per triangle
  /// Originals of the mesh's last vertices, in order: these are copies of another colour at the same place. A mesh
  /// without normals is as smooth there as without copies. double_vertices() adds them.
  std::vector<uint32_t> copy_of;
  /// Values of the requested array: one per vertex, or per triangle with scalars_of_faces. Each is the file's minus
  /// scene::scalar_origin() of its span; NaN where that is not finite. Empty: no array was requested.
  std::vector<float> scalars;
  bool scalars_of_faces = false;
  bool smooth = false;                   ///< sampled from a field: it has no creases, only coarse triangles
  std::vector<scene::ArrayInfo> arrays;  ///< all arrays of the file, requested or not; make_tellable() was called
  uint64_t degenerate_dropped = 0;       ///< faces with fewer than three corners
  std::vector<std::string> notes;        ///< remarks on reading for users: lines that name the file
  /// The box to place in the room instead of the mesh's own: for a surface its volume's grid, so that both stand at one
  /// place in one size.
  std::optional<geometry::DBox> frame;
  /// Relation of positions to the file's coordinates, and the kind of these.
  scene::Coordinates coordinates;
};

/// Checks the guarantees of every reader: at least one triangle, no more than kMaxTriangles, every index below the
/// number of vertices, every position finite, normals and colours absent or one per vertex. Errors start with `name`.
Status validate_mesh(const Mesh& mesh, const std::string& name);

/// Drops triangles with corners that are not finite, and adds a note; such vertices move to (0, 0, 0). Returns true if
/// indices and positions are as validate_mesh() demands. If no triangle would be left, or an index is wrong, nothing is
/// changed.
bool drop_not_finite(Mesh& mesh, const std::string& name);

/// Gives triangles one colour each: their vertices get it. Vertices between triangles of different colours are doubled,
/// with their normals and scalars.
/// of_triangles: one per triangle, 0x00RRGGBB or kNoColour. Precondition: every index is below the number of vertices.
void colour_faces(Mesh& mesh, std::span<const uint32_t> of_triangles);

/// Packs 8-bit channels into 0x00RRGGBB.
constexpr uint32_t pack_rgb(uint32_t r, uint32_t g, uint32_t b) { return r << 16 | g << 8 | b; }

/// Opens a mesh to be read here and there.
using OpenRandom = std::function<Result<std::shared_ptr<const RandomMesh>>(const ReadProgress&)>;

struct MeshSource {
  uint64_t hash = 0;    ///< over the content of all files that the mesh is read from
  std::string variant;  ///< other settings that change the mesh, as part of a file name; often empty
  /// Reads the mesh; the result has passed validate_mesh.
  std::function<Result<Mesh>(const ReadProgress&)> read;
  std::string array;  ///< the array that colours it, as for scene::choose_array(); part of the variant; empty: no array
  /// Opens the same mesh; null: it can only be read whole, or is small.
  OpenRandom random = nullptr;
};

/// Returns the hash of the files' contents, in this order. Unreadable files are left out: reading them reports the
/// error. Calls progress with stage kIdentifying.
uint64_t hash_files(const std::vector<std::string>& paths, const Progress& progress);

}  // namespace telesplat::data
