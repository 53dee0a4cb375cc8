// The coarse form of the whole data set, as triangles: pictures show it where points leave pixels empty (backdrop.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "common/geometry/box.h"
#include "common/geometry/mesh_chunk.h"

namespace telesplat::splat {

/// Some triangles, near each other. Positions in the room, metres; unit normals; albedo 0x00RRGGBB.
struct BasePart {
  static constexpr size_t kMostTriangles = 4096;

  geometry::Box box_room;
  std::vector<glm::vec3> positions, normals;
  std::vector<uint32_t> colours;
  std::vector<uint16_t> indices;  ///< three a triangle, each below positions.size()
  std::vector<glm::vec4> planes;  ///< plane of each triangle: unit normal, and its product with points of the plane
};

/// Finds the planes of a part that has all else. A triangle without area gets a normal of 0.
void find_planes(BasePart& part);

/// Takes a chunk apart. Precondition: its colours are no scalars, and it has at most kMostTriangles triangles and three
/// vertices for each.
BasePart base_part(const geometry::MeshChunkView& chunk);

/// From where a base is looked at.
struct Viewpoint {
  glm::dvec3 eye_room{0};
  double fine = 0;  ///< error that is fine enough, over the distance
};

struct BaseMesh;

/// The base on display, or null.
struct ShownBase {
  std::shared_ptr<const BaseMesh> mesh;
  std::optional<Viewpoint> from;  ///< from where the newest picture shows it; nothing: there is no picture
};

/// Distance of a place from the nearest point of a box, metres.
double distance_m(const geometry::Box& box, const glm::dvec3& from);

/// A piece of the mesh, and pieces of it at a finer level.
struct BaseNode {
  using Bits = std::vector<uint64_t>;
  struct Part {
    std::shared_ptr<const BasePart> triangles;
    std::shared_ptr<const Bits> hidden;  ///< triangles that are not drawn, a bit each; null: all are
  };

  geometry::Box box_room;
  float error_m = 0;                       ///< how far the surface may lie from its triangles, about
  uint32_t first_child = 0, children = 0;  ///< nodes that have its triangles, finer; 0: none has come
  std::vector<Part> parts;
  double part_m = 0;  ///< largest diagonal of a part's box
};

struct BaseMesh {
  std::vector<BaseNode> nodes;  ///< the first `roots` have the whole mesh; children come later
  size_t roots = 0;
  uint64_t number = 0;  ///< another mesh has another one
};

}  // namespace telesplat::splat
