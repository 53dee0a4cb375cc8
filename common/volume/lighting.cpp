#include "common/volume/lighting.h"

#include "common/geometry/trajectory.h"
#include "common/image/shading.h"
#include "common/volume/voxels.h"

namespace telesplat::volume {

std::vector<float> normal_intensities(const Grid& grid, const glm::dvec3& eye_room) {
  // A camera turned to the volume's centre; if the eye is at the centre, with the default orientation.
  const glm::dvec3 centre = grid.centre_room();
  geometry::Camera camera;
  camera.pose.position_room = eye_room;
  if (glm::length(centre - eye_room) > 1e-9 * (1 + glm::length(centre)))
    camera.pose = geometry::look_at(eye_room, centre);
  const image::Shading shading(image::ShadingParameters{}, camera);
  std::vector<float> out(65536);
  for (size_t n = 0; n < out.size(); ++n) out[n] = static_cast<float>(shading.table()[n]) / 255.0f;
  const glm::vec3 towards_eye(camera.pose.orientation * glm::dvec3(0, 0, 1));
  out[kNoNormal] = static_cast<float>(static_cast<int>(shading.intensity(towards_eye) * 255.0f + 0.5f)) / 255.0f;
  return out;
}

}  // namespace telesplat::volume
