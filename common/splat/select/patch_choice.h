// Chooses the patches of a cluster to draw if packing kept redundant ones (T4.4.3.3).
#pragma once

#include <glm/mat4x4.hpp>
#include <vector>

#include "common/points/point_model.h"

namespace telesplat::splat {

/// The camera figures for the choice, made once a frame.
struct PatchView {
  glm::mat4 view;  ///< room -> X right, Y up, Z backward
  float focal_x, focal_y, near_m;
};
PatchView patch_view(const geometry::Camera& camera);

/// Quality of a mosaic's samples as seen by a camera: q = (r1 / r0) (1 / r0), T eq. 4.1. r0 >= r1 are the radii, in
/// pixels, of a surfel's output contour (T4.4.1). The surfel lies at the mosaic's centroid, with its cone's axis as
/// normal. Its footprint on the tangent plane is a circle of half the samples' spacing, stretched along the slope by
/// which the sampling view saw it. The conic of its projection is taken in its dual form, and a pixel's own variance is
/// added: samples much finer than a pixel do not count as better. In (0, 2]; 0 if the surfel is behind the camera.
float surfel_quality(const points::Mosaic& mosaic, const geometry::Box& leaf_room, const PatchView& view);

/// Surface area that the mosaic's samples cover, in faces of its leaf: count * (spacing / leaf size)^2 / cosine of the
/// slope at which they were taken.
float surface_covered(const points::Mosaic& mosaic);

/// Chooses among the patches of one cluster. A patch is all mosaics with one frame tag, in any number of blocks.
///
/// Patches are taken in order of falling quality: that of a surfel at the patch's centroid, with the mean of its cones'
/// axes. Each is drawn unless one that is drawn already shows the same surface. A patch shows another's surface if
///   it covers at least 1 / 1.1 of the area, and
///   the centres are so near that at least nine tenths of the smaller patch's extent lie inside the larger one's.
/// Area and centre are estimated from samples, so both tests allow for the estimate's error. A patch of n samples is a
/// piece of a grid that the leaf's faces cut by whole rows: its area is known to 1.5 / sqrt n of itself, its centre to
/// half the samples' spacing. Without this a coarse patch would count as larger than a fine one only because its few
/// samples round up.
///
/// The best patch is always drawn. If it is partial, as while its frame is coming in, others fill the rest.
class PatchChooser {
 public:
  /// Removes from `mosaics` those of patches that are not drawn. Keeps the order.
  void choose(const geometry::Box& leaf_room, const PatchView& view, std::vector<const points::Mosaic*>& mosaics);

 private:
  struct Patch {
    uint32_t frame;
    float pixel_range;
    glm::vec3 to_eye;
    float covered = 0, points = 0, quality = 0;
    float covered_off = 0, centre_off = 0;  // errors of the estimates: share of `covered`, and in leaves
    glm::vec3 centre{0}, normal{0};         // sums while gathering, then means
    bool drawn = false;
  };
  bool shows(const Patch& better, const Patch& patch, float leaf_m) const;
  std::vector<Patch> patches_;  // members, so that their memory is reused
  std::vector<uint32_t> patch_of_, by_quality_;
};

}  // namespace telesplat::splat
