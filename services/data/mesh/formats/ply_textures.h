// The pictures of a PLY file, as MeshLab, CloudCompare and Blender name and place them.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "services/data/base/companions.h"
#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Takes the corners of triangles while the body is read, then bakes the pictures into the mesh's colours.
class PlyTextures {
 public:
  /// texture: the picture's place among the header's; any number may stand there. place: v goes up from the picture's
  /// lower rim; a place that is no number: the triangle has no picture.
  void add_corner(double texture, glm::vec2 place);

  /// Vertices are doubled where places or pictures differ. The picture's colours replace those of vertices.
  /// pictures: the header's. Error: a picture is damaged or too large. Precondition: three corners for each triangle,
  /// and every index is below the number of vertices.
  Status bake(Mesh& mesh, const std::vector<std::string>& pictures, const std::string& name, Companions& companions,
              uint64_t texture_detail) const;

 private:
  struct Corner {
    uint32_t picture;
    glm::vec2 place;
    bool operator==(const Corner&) const = default;
  };
  std::vector<Corner> corners_;
};

}  // namespace telesplat::data
