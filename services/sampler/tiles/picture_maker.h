// Pictures of sampled tiles, for sessions that show pictures: shaded like viewers shade points, over the background, as
// JPEG. A view that its viewer asks for again has not changed since: it is drawn finer.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/image/depth_image.h"
#include "common/image/shading.h"
#include "common/wire/messages.h"

namespace telesplat::sampler {

class PictureMaker {
 public:
  static constexpr int kStillQuality = 95, kStillSamples = 4;  ///< least for a still view

  /// Takes the session's settings for pictures, "picture.*".
  void follow(const wire::Welcome& session);
  bool on() const { return quality_ > 0; }

  /// Rays that are to be sampled for a tile of a view.
  struct Rays {
    int side = 1;                      ///< rays a pixel, on each axis
    int quality = 0;                   ///< JPEG quality
    std::optional<wire::Lease> lease;  ///< the tile with these rays as its pixels; nullopt: one ray a pixel, as leased
  };
  /// Returns the rays for a leased tile. Precondition: on().
  Rays rays(const wire::Lease& lease);
  /// Returns the tile as JPEG. sampled: the image of `rays`.
  std::vector<std::byte> picture(const wire::Lease& lease, const Rays& rays, const image::DepthImage& sampled);

 private:
  struct Seen {
    FrameId frame;
    geometry::Camera camera;
    EpochId epoch;
    bool still = false;
  };
  bool is_still(const wire::Lease& lease);

  int quality_ = 0, samples_ = 1;
  image::ShadingParameters parameters_;
  std::optional<image::Shading> shading_;  // shading for the camera shaded_
  geometry::Camera shaded_;
  std::map<InstanceId, Seen> seen_;  // the newest frame of each viewer
};

}  // namespace telesplat::sampler
