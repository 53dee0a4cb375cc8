// Pictures of sampled tiles, where a session shows what its servers draw: shaded like what viewers draw of points, over
// the background, as JPEG. A view that its viewer asks for again has not changed since: it is drawn finer.
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
  static constexpr int kStillQuality = 95, kStillSamples = 4;  ///< of a still view, at least

  /// What the session wants of pictures: its settings "picture.*".
  void follow(const wire::Welcome& session);
  bool on() const { return quality_ > 0; }

  /// What is to be sampled for a tile of a view.
  struct Rays {
    int side = 1;                      ///< rays a pixel, on each axis
    int quality = 0;                   ///< of JPEG
    std::optional<wire::Lease> lease;  ///< the tile with these rays as its pixels; none: of one ray a pixel, as leased
  };
  /// Precondition: on().
  Rays rays(const wire::Lease& lease);
  /// JPEG of the tile. sampled: what rays() asked for.
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
  std::optional<image::Shading> shading_;  // of shaded_
  geometry::Camera shaded_;
  std::map<InstanceId, Seen> seen_;  // the newest frame of each viewer
};

}  // namespace telesplat::sampler
