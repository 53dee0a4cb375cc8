#include "services/packer/points/plan/viewer_views.h"

#include <algorithm>

namespace telesplat::packer {
namespace {

size_t pixels_of(const geometry::Camera& camera) {
  return static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
}

// Of its maps.
size_t pixels_in(const ViewerView& v) {
  const size_t each = pixels_of(v.camera);
  return (v.map ? each : 0) + (v.fine_map && v.fine_map != v.map ? each : 0);
}

geometry::Box grown(const geometry::Box& box, float by_m) { return {box.lo - by_m, box.hi + by_m}; }

}  // namespace

void forget_casts(ViewerView& view) {
  const int width = view.camera.width, height = view.camera.height;
  view.done.reset(width, height);
  view.doubted.reset(width, height);
  for (image::PixelMask& mask : view.refined) mask.reset(width, height);
  for (auto& tiles : view.found) tiles.clear();
  view.cells_done = 0;
  view.fine_map = nullptr;
  view.looks = 0;
  view.lost.clear();
  view.cell_rays = 0;
}

void follow(const geometry::Camera& camera, ViewerView& view) {
  view.still = view.known && view.camera == camera;
  view.movement_m = view.known ? camera.pose.position_room - view.camera.pose.position_room : glm::dvec3(0);
  if (view.still) return;
  view.camera = camera;
  view.known = true;
  view.map = nullptr;
  forget_casts(view);
}

bool may_see(const geometry::Camera& camera, double around_m, const points::ModelConfig& model,
             std::span<const points::ClusterKey> leaves) {
  // Views from beside see a little more on each side; splats stand out of their leaf.
  const int x = camera.width / 16 + 1, y = camera.height / 16 + 1;
  const geometry::Frustum frustum(geometry::crop(camera, {-x, -y, camera.width + 2 * x, camera.height + 2 * y}));
  const auto out_m = static_cast<float>(around_m + points::octree_grid(model).leaf_size);
  return std::any_of(leaves.begin(), leaves.end(), [&](points::ClusterKey key) {
    return frustum.may_contain(grown(points::leaf_box(model, key), out_m));
  });
}

ViewerView* ViewerViews::find(InstanceId viewer) {
  const auto found =
      std::find_if(views_.begin(), views_.end(), [&](const ViewerView& v) { return v.viewer == viewer; });
  return found == views_.end() ? nullptr : &*found;
}

ViewerView& ViewerViews::use(InstanceId viewer) {
  auto used = std::find_if(views_.begin(), views_.end(), [&](const ViewerView& v) { return v.viewer == viewer; });
  if (used == views_.end()) {
    used = views_.emplace(views_.begin());
    used->viewer = viewer;
  }
  views_.splice(views_.begin(), views_, used);
  size_t views = 0, pixels = 0, maps = 0, map_pixels = 0;
  std::erase_if(views_, [&](const ViewerView& v) {
    pixels += pixels_of(v.camera);
    return ++views > kMaxViewers || (views > 1 && pixels > kMaxViewPixels);
  });
  for (ViewerView& v : views_) {
    maps += (v.map != nullptr) + (v.fine_map && v.fine_map != v.map);
    map_pixels += pixels_in(v);
    if (&v == &views_.front() || (maps <= kMaxMaps && map_pixels <= kMaxMapPixels)) continue;
    v.map = nullptr, v.fine_map = nullptr;
  }
  return views_.front();
}

size_t ViewerViews::map_pixels() const {
  size_t out = 0;
  for (const ViewerView& v : views_) out += pixels_in(v);
  return out;
}

void ViewerViews::forgotten(const points::ModelConfig& model, double around_m,
                            std::span<const points::ClusterKey> leaves) {
  for (ViewerView& view : views_)
    if (view.known && may_see(view.camera, around_m, model, leaves)) forget_casts(view);
}

}  // namespace telesplat::packer
