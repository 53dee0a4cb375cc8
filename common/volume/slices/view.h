// Finds parts of slice images that a camera may see: the others need not be sent to its viewer.
#pragma once

#include "common/geometry/camera.h"
#include "common/volume/shear.h"

namespace telesplat::volume {

class SliceView {
 public:
  /// margin: share of its width and height by which the camera's image is widened on every side, so that the view can
  /// turn a little before an edge shows. Precondition: validate(shear, grid).
  SliceView(const Grid& grid, const ShearFrame& shear, const geometry::Camera& camera, double margin);

  /// False only if the block (image.h) in column x and row y, on the plane of `layer`, cannot be seen.
  /// Precondition: the layer and the block are the frame's.
  bool may_see(int layer, int x, int y) const;

 private:
  const ShearFrame& shear_;
  glm::dmat4 index_to_camera_;
  double left_, right_, bottom_, top_;  // tangents, as Camera's
};

}  // namespace telesplat::volume
