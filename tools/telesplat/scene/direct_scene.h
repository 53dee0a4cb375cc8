// A scene as rays see it, without points: what displayed frames are compared with, and what poses are sampled from anew.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/file.h"
#include "common/image/quality.h"
#include "common/image/shading.h"
#include "services/data/mesh/store.h"
#include "tools/telesplat/scene/recorded_julia.h"
#include "tools/telesplat/scene/recorded_volume.h"

namespace telesplat::launcher {

class DirectScene {
 public:
  virtual ~DirectScene() = default;

  /// The scene of `epoch`: every pixel of `camera` traced and shaded with unquantised normals. Depth in metres, +infinity where nothing is.
  /// Error: the scene of that epoch is not known.
  virtual Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                   EpochId epoch) = 0;
  /// One sampling frame, as a sampler takes it. Error: as draw().
  virtual Result<image::DepthImage> sample(const geometry::Camera& camera, EpochId epoch) = 0;

  /// How good `view` is. The pixels that count are those where either shows the data set: of surfaces by their depth.
  virtual image::Quality compare(const image::View& reference, const image::View& view,
                                 const image::ShadingParameters& shading) const {
    (void)shading;
    return image::compare(reference, view);
  }

  virtual geometry::Box box_room() const = 0;
  virtual uint64_t primitives() const = 0;  ///< triangles; 0 of a scene without
  virtual std::string size() const = 0;     ///< "20000 triangles", for captions
};

/// Opens the mesh at `path`. threads: to trace with, 0: all cores. progress(stage, fraction).
Result<std::unique_ptr<DirectScene>> open_direct_mesh(const std::string& path, const data::MeshOptions& options,
                                                      int threads,
                                                      const std::function<void(const char*, double)>& progress);

/// Opens the volume of a run; each epoch's voxels go through the ray caster (services/sampler/volume/raycaster.h). sample() is an error.
Result<std::unique_ptr<DirectScene>> open_direct_volume(RecordedVolume recorded, int threads,
                                                        const std::function<void(const char*, double)>& progress);

std::unique_ptr<DirectScene> open_direct_julia(RecordedJulia julia, int threads);

}  // namespace telesplat::launcher
