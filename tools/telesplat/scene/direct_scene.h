// A scene as rays see it, without points: what displayed frames are compared with, and what poses are sampled from
// anew.
#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/file.h"
#include "common/image/measures/reference.h"
#include "common/image/shading.h"

namespace telesplat::launcher {

class DirectScene {
 public:
  virtual ~DirectScene() = default;

  /// The scene of `epoch`: every pixel of `camera` traced and shaded with unquantised normals. Depth in metres,
  /// +infinity where nothing is. Error: the scene of that epoch is not known.
  /// footprint_px: pixels of `camera` that are one of the view it is drawn for: what a pixel shows may depend on how
  /// large it is (sampler::JuliaSampler).
  virtual Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                   EpochId epoch, double footprint_px) = 0;
  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId epoch) {
    return draw(camera, shading, epoch, 1);
  }
  /// The same with `samples` rays a pixel (image::validate_samples), or one of what has no surface. It is marked
  /// (mark_shown).
  Result<image::Reference> draw_reference(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                          EpochId epoch, int samples) {
    const int rays = has_surface() ? samples : 1;
    return image::supersample(camera, rays, [&](const geometry::Camera& piece) {
      auto drawn = draw(piece, shading, epoch, std::sqrt(rays));
      if (drawn) mark_shown(*drawn);
      return drawn;
    });
  }
  /// All of a sampling frame, as samplers take it. Error: as draw(), or the scene has no surface.
  virtual Result<image::DepthImage> sample(const geometry::Camera& camera, EpochId epoch) = 0;

  /// Whether pictures have the depth of a surface.
  virtual bool has_surface() const { return true; }
  /// Gives a picture, drawn directly or displayed, the depth by which measures find what shows the data set: surfaces
  /// have it.
  virtual void mark_shown(image::View& view) const { (void)view; }

  virtual geometry::Box box_room() const = 0;
  virtual uint64_t primitives() const { return 0; }  ///< triangles; 0: it has none
  virtual std::string size() const = 0;              ///< "20000 triangles", for captions
};

}  // namespace telesplat::launcher
