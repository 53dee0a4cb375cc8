// A scene as rays see it, without points: what displayed frames are compared with, and what poses are sampled from
// anew.
#pragma once

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

namespace telesplat::launcher {

class DirectScene {
 public:
  virtual ~DirectScene() = default;

  /// The scene of `epoch`: every pixel of `camera` traced and shaded with unquantised normals. Depth in metres,
  /// +infinity where nothing is. Error: the scene of that epoch is not known.
  virtual Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                   EpochId epoch) = 0;
  /// One sampling frame, as a sampler takes it. Error: as draw(), or the scene has no surface.
  virtual Result<image::DepthImage> sample(const geometry::Camera& camera, EpochId epoch) = 0;

  /// How good `view` is. The pixels that count are those where either shows the data set. Surfaces show by their depth.
  virtual image::Quality compare(const image::View& reference, const image::View& view,
                                 const image::ShadingParameters& shading) const {
    (void)shading;
    return image::compare(reference, view);
  }

  virtual geometry::Box box_room() const = 0;
  virtual uint64_t primitives() const { return 0; }  ///< triangles; 0: it has none
  virtual std::string size() const = 0;              ///< "20000 triangles", for captions
};

}  // namespace telesplat::launcher
