#include "common/splat/view_selection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace telesplat::splat {
namespace {

// Normals interpolated over a mesh turn away before the surface does: cones are widened by 10 degrees.
constexpr float kCosMargin = 0.98480775f, kSinMargin = 0.17364818f;

// A leaf's cube as seen from the eye: what of the cone test is the same for all its mosaics.
struct LeafView {
  glm::vec3 to_eye;  // from the cube's centre
  float sin_beta,
      cos_beta;  // beta = margin + half the angle under which the cube's sphere is seen; cos_beta < 0: never away
  float distance;
};

LeafView leaf_view(const geometry::Box& leaf, const glm::vec3& eye) {
  const glm::vec3 to_eye = eye - leaf.centre();
  const float distance2 = glm::dot(to_eye, to_eye), radius2 = 0.25f * glm::dot(leaf.size(), leaf.size());
  if (!(distance2 > radius2)) return {to_eye, 1.0f, -1.0f, 0.0f};
  const float sin_half = std::sqrt(radius2 / distance2), cos_half = std::sqrt(1.0f - radius2 / distance2);
  return {to_eye, sin_half * kCosMargin + cos_half * kSinMargin, cos_half * kCosMargin - sin_half * kSinMargin,
          std::sqrt(distance2)};
}

// Away if the angle between the cone's axis and the direction to the eye exceeds 90 degrees + cone + beta.
bool cone_faces_away(const points::Mosaic& m, const LeafView& view) {
  const float cos_cone = m.cone_cosine();
  if (cos_cone <= 0 || view.cos_beta <= 0) return false;
  const float sin_cone = std::sqrt(1.0f - cos_cone * cos_cone);
  if (cos_cone * view.cos_beta - sin_cone * view.sin_beta <= 0) return false;  // cone + beta >= 90 degrees
  const float sin_sum = sin_cone * view.cos_beta + cos_cone * view.sin_beta;
  return glm::dot(m.cone_axis(), view.to_eye) < -sin_sum * view.distance;
}

// Chooses level and splat size of one mosaic. ratio = desired pixel range over level 0's.
int choose_level(float ratio) {
  // Level l's range is 2^-l of level 0's; half way in ratio lies a factor of sqrt(2).
  static_assert(points::kLevels == 3);
  return ratio >= 0.70710678f ? 0 : ratio >= 0.35355339f ? 1 : 2;
}

// A mosaic chosen from the cluster at hand, before its size is final.
struct Chosen {
  const points::Mosaic* mosaic;
  int level;
  float size;      // splat size by T eq. 4.8, not clamped
  float coverage;  // share of the leaf's face that its points cover: points * (sample size / leaf size)^2
};

// T4.4.3: where a low-rate mosaic would hide high-rate ones its splats shrink.
// We deviate in one thing: after redundancy elimination a low-rate mosaic may be all there is in most of the cluster, and a
// handful of high-rate points elsewhere in it would tear holes. So splats shrink only if mosaics of higher rate cover at
// least as much of the cluster as the low-rate one does.
void revise_sizes(const SelectionOptions& options, std::vector<Chosen>& chosen) {
  const auto mismatch = [&](const Chosen& c) { return std::abs(std::log(c.size / options.scale)); };
  const float smallest =
      std::min_element(chosen.begin(), chosen.end(), [](auto& a, auto& b) { return a.size < b.size; })->size;
  const float largest =
      std::max_element(chosen.begin(), chosen.end(), [](auto& a, auto& b) { return a.size < b.size; })->size;
  if (largest <= options.hide_ratio * smallest) return;
  const float best =
      std::min_element(chosen.begin(), chosen.end(), [&](auto& a, auto& b) { return mismatch(a) < mismatch(b); })->size;
  const float threshold = options.hide_ratio * best;
  float fine = 0;
  for (const Chosen& c : chosen) fine += c.size <= threshold ? c.coverage : 0.0f;
  for (Chosen& c : chosen)
    if (c.size > threshold && fine >= c.coverage) c.size = std::min(c.size, best + options.hide_epsilon * c.size);
}

}  // namespace

bool faces_away(const points::Mosaic& mosaic, const geometry::Box& leaf_room, const glm::vec3& eye_room) {
  return cone_faces_away(mosaic, leaf_view(leaf_room, eye_room));
}

void select_view(const points::PointModel& model, const geometry::Camera& camera, const SelectionOptions& options,
                 DrawList& out) {
  out.items.clear();
  out.clusters_seen.clear();
  out.points = 0;
  out.scale = options.scale;
  const geometry::Frustum frustum(camera);
  const glm::vec3 eye(camera.pose.position_room);
  std::vector<Chosen> chosen;
  for (const auto& [key, cluster] : model.clusters()) {
    const geometry::Box& leaf = cluster->leaf_room;
    if (!frustum.may_contain(leaf)) continue;
    out.clusters_seen.push_back(key);
    const float desired = options.detail * points::pixel_range(camera, glm::dvec3(leaf.centre()),
                                                               static_cast<double>(leaf.hi.x - leaf.lo.x));
    const LeafView view = leaf_view(leaf, eye);
    const float metres_per_px = (leaf.hi.x - leaf.lo.x) * options.detail / desired;
    chosen.clear();
    for (const points::Mosaic& m : cluster->mosaics) {
      if (options.cone_culling && cone_faces_away(m, view)) continue;
      const float ratio = desired / m.pixel_range();
      const int level = choose_level(ratio);
      // eq. 4.8, with the display's own pixel size: fewer points (detail < 1) are drawn larger, not farther apart.
      const float size = options.scale * ratio / options.detail * static_cast<float>(1 << level);
      chosen.push_back({&m, level, size, static_cast<float>(m.count(0)) / (m.pixel_range() * m.pixel_range())});
    }
    if (chosen.size() > 1) revise_sizes(options, chosen);
    for (const Chosen& c : chosen) {
      const points::Mosaic::Level level = c.mosaic->level(c.level);
      if (level.count == 0) continue;
      const float px = std::min(c.size, std::max(1.0f, options.max_splat_px));
      out.items.push_back({cluster.get(), level, std::max(px, 1.0f), c.mosaic->sequence(), 0.5f * px * metres_per_px,
                           c.mosaic->direction_to_eye()});
      out.points += level.count;
    }
  }
}

}  // namespace telesplat::splat
