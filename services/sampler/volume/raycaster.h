// The reference for the splatter: rays through the same field, in double precision.
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
/// precision, without early termination before 1e-6 of light is left. Classified before interpolation, since voxels
/// travel classified. Lit by volume/lighting.h for the camera's eye.
class VolumeRaycaster {
 public:
  /// voxels: of all slices; voxels whose centres the clip cuts away are left out.
  VolumeRaycaster(const volume::Grid& grid, const volume::Voxels& voxels, std::vector<volume::LevelColour> colours,
                  int threads, const geometry::Clip& clip = {});
  ~VolumeRaycaster();
  /// Returns colours over the background, with the volume's coverage of the pixel in the upper byte; depth as in
  /// volume::WarpTarget.
  image::View draw(const geometry::Camera& camera, uint32_t background, double step = 0.25) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::sampler
