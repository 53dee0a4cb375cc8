// Room for what is drawn.
#pragma once

#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Makes room for a frame of this camera, with depth or without. What it held is void.
inline void fit(image::View& view, const geometry::Camera& camera, bool with_depth) {
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  view.width = camera.width;
  view.height = camera.height;
  view.colour.resize(pixels);
  view.depth_m.resize(with_depth ? pixels : 0);
}

}  // namespace telesplat::viewer
