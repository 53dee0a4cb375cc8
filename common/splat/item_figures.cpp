#include "common/splat/item_figures.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

namespace telesplat::splat {

FrameFigures::FrameFigures(const KernelTraits& kernel, const geometry::Camera& camera, float scale)
    : kernel_(kernel),
      scale_(scale),
      near_m_(static_cast<float>(camera.near_m)),
      camera_(surfel_camera(camera)),
      depth_row_(camera.room_to_pixel().w) {
  if (kernel.surfel) return;
  for (size_t quarters = 4; quarters < flat_.size(); ++quarters)
    flat_[quarters] = flat_splat(kernel, static_cast<float>(quarters) * 0.25f, camera.focal_x());
}

ItemFigures FrameFigures::add(const DrawItem& item) {
  ItemFigures figures;
  figures.spacing = kernel_.smoothed ? spacing_class(item.splat_px / scale_) : 0;
  if (!kernel_.surfel) {
    figures.flat = &flat_[static_cast<size_t>(square_size(item.splat_px) * 4.0f)];
    add_bias(figures.spacing, figures.flat->rim_bias, item.level.count);
    return figures;
  }
  figures.source = surfel_source(camera_, item.radius_m, item.to_eye);
  if (!kernel_.surfel_bias) return figures;
  const auto depth_m = static_cast<float>(glm::dot(depth_row_, glm::dvec4(item.cluster->leaf_room.centre(), 1)));
  if (depth_m >= near_m_) add_bias(figures.spacing, kernel_.surfel_bias(item.radius_m, depth_m), item.level.count);
  return figures;
}

RimBias FrameFigures::rim() const {
  RimBias rim{};
  for (size_t i = 0; i < rim.size(); ++i)
    if (points_[i] > 0) rim[i] = static_cast<uint32_t>(std::lround(bias_[i] / points_[i]));
  return rim;
}

}  // namespace telesplat::splat
