// The reference: rays through the same field, in double precision.
#pragma once

#include <memory>

#include "common/geometry/camera.h"
#include "common/geometry/clip.h"
#include "common/image/file.h"
#include "common/volume/grid.h"
#include "common/volume/transfer/function.h"
#include "common/volume/voxels.h"

namespace telesplat::sampler {

/// Integrates emission and absorption along every pixel's ray: extinction and extinction times colour are interpolated
/// trilinearly between voxels (0 outside [-1, n]), steps of `step` voxels (the smallest side of one), in double
/// precision, without early termination before 1e-6 of light is left. Classified before interpolation, as voxels
/// travel. Lit by volume/lighting.h for the camera's eye.
class VolumeRaycaster {
 public:
  /// voxels: of all slices; those whose centres the clip cuts away are not there.
  VolumeRaycaster(const volume::Grid& grid, const volume::Voxels& voxels, std::vector<volume::LevelColour> colours,
                  int threads, const geometry::Clip& clip = {});
  ~VolumeRaycaster();
  /// Colours over background, in the upper byte how much of the pixel the volume covers; depth as volume::WarpTarget
  /// has it.
  image::View draw(const geometry::Camera& camera, uint32_t background, double step = 0.25) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::sampler
