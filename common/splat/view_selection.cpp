#include "common/splat/view_selection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/splat/level_choice.h"
#include "common/splat/patch_choice.h"

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
  // Most mosaics that are drawn face the eye: they need no root.
  const glm::vec3 axis = m.cone_axis_direction();
  const float towards = glm::dot(axis, view.to_eye);
  if (towards >= 0) return false;
  const float cos_cone = m.cone_cosine();
  if (cos_cone <= 0 || view.cos_beta <= 0) return false;
  const float sin_cone = std::sqrt(1.0f - cos_cone * cos_cone);
  if (cos_cone * view.cos_beta - sin_cone * view.sin_beta <= 0) return false;  // cone + beta >= 90 degrees
  const float sin_sum = sin_cone * view.cos_beta + cos_cone * view.sin_beta;
  return towards < -sin_sum * view.distance * std::sqrt(glm::dot(axis, axis));
}

// A mosaic chosen from the cluster at hand, before its size is final.
struct Chosen {
  const points::Mosaic* mosaic;
  Drawn drawn;
  float size;      // splat size by T eq. 4.8 for points spread evenly, not clamped
  float coverage;  // share of the leaf's face that its points cover: points * (sample size / leaf size)^2
};

// 0 up to `from`, 1 from `to` on.
float ramp(float x, float from, float to) { return std::clamp((x - from) / (to - from), 0.0f, 1.0f); }

// T4.4.3: where a low-rate mosaic would hide high-rate ones its splats shrink.
// We deviate in two things. After redundancy elimination a low-rate mosaic may be all there is in most of the cluster, and a
// handful of high-rate points elsewhere in it would tear holes: splats shrink only if mosaics of higher rate cover at least as
// much of the cluster as the low-rate one does. And nothing jumps: sizes and coverages pass the two thresholds over a quarter of
// their height.
void revise_sizes(const SelectionOptions& options, std::vector<Chosen>& chosen) {
  float smallest = chosen.front().size, largest = smallest;
  for (const Chosen& c : chosen) smallest = std::min(smallest, c.size), largest = std::max(largest, c.size);
  if (largest <= options.hide_ratio * smallest) return;
  const auto mismatch = [&](float size) { return std::max(size, options.scale * options.scale / size); };
  float best = smallest;
  for (const Chosen& c : chosen)
    if (mismatch(c.size) < mismatch(best)) best = c.size;
  const float threshold = options.hide_ratio * best;
  float fine = 0;
  for (const Chosen& c : chosen) fine += c.coverage * (1.0f - ramp(c.size, threshold, 1.25f * threshold));
  for (Chosen& c : chosen) {
    const float share = ramp(c.size, threshold, 1.25f * threshold) * ramp(fine, c.coverage, 1.25f * c.coverage);
    c.size += share * std::min(best + options.hide_epsilon * c.size - c.size, 0.0f);
  }
}

// In [0, 1), the same in every frame, as if drawn at random for each mosaic.
float dither_of(points::ClusterKey key, const points::Mosaic& m) {
  const uint64_t h = (m.sequence().value << 32 ^ key) * 0x9e3779b97f4a7c15ull;
  return static_cast<float>(h >> 40) * 0x1p-24f;
}

// The patches that the mosaics drawn of a cluster are of.
void note_patches(points::ClusterKey key, const std::vector<const points::Mosaic*>& drawn, DrawList& out) {
  const auto first = static_cast<ptrdiff_t>(out.frames_seen.size());
  for (const points::Mosaic* m : drawn) {
    const uint32_t frame = m->frame_tag();
    if (std::find(out.frames_seen.begin() + first, out.frames_seen.end(), frame) != out.frames_seen.end()) continue;
    out.clusters_seen.push_back(key);
    out.frames_seen.push_back(frame);
  }
}

// Points [first, last) of a mosaic's level.
DrawItem make_item(const points::Cluster& cluster, const points::Mosaic& m, int l, uint32_t first, uint32_t last) {
  const points::Mosaic::Level a = m.level(l);
  return {.cluster = &cluster,
          .level = {last - first, a.x + first, a.y + first, a.z + first, a.normal + first, a.colour + first},
          .splat_px = 1,
          .sequence = m.sequence(),
          .to_eye = m.direction_to_eye(),
          .first = first,
          .of = a.count};
}

}  // namespace

bool faces_away(const points::Mosaic& mosaic, const geometry::Box& leaf_room, const glm::vec3& eye_room) {
  return cone_faces_away(mosaic, leaf_view(leaf_room, eye_room));
}

void select_view(const points::PointModel& model, const geometry::Camera& camera, const SelectionOptions& options,
                 DrawList& out) {
  out.items.clear();
  out.clusters_seen.clear();
  out.frames_seen.clear();
  out.points = 0;
  out.scale = options.scale;
  const geometry::Frustum frustum(camera);
  const glm::vec3 eye(camera.pose.position_room);
  const PatchView patches = patch_view(camera);
  PatchChooser chooser;
  std::vector<const points::Mosaic*> visible;
  std::vector<Chosen> chosen;
  double distance_sum = 0;
  for (const auto& [key, cluster] : model.clusters()) {
    const geometry::Box& leaf = cluster->leaf_room;
    if (!frustum.may_contain(leaf)) continue;
    const float leaf_m = leaf.hi.x - leaf.lo.x;
    const float range = points::pixel_range(camera, glm::dvec3(leaf.centre()), static_cast<double>(leaf_m));
    const float radius_m_of_px = 0.5f * leaf_m / range;
    const LeafView view = leaf_view(leaf, eye);
    visible.clear();
    for (const points::Mosaic& m : cluster->mosaics)
      if (!(options.cone_culling && cone_faces_away(m, view))) visible.push_back(&m);
    if (options.best_patch_only) {
      chooser.choose(leaf, patches, visible);
      note_patches(key, visible, out);
    } else {
      out.clusters_seen.push_back(key);
    }
    chosen.clear();
    for (const points::Mosaic* mosaic : visible) {
      const points::Mosaic& m = *mosaic;
      const float ratio = range / m.pixel_range(), wanted = options.detail * std::min(ratio, 1.0f);
      const Drawn drawn = options.transitions ? between_levels(m, wanted, dither_of(key, m)) : closest_level(m, wanted);
      chosen.push_back({&m, drawn, options.scale * ratio * drawn.spacing,
                        static_cast<float>(m.count(0)) / (m.pixel_range() * m.pixel_range())});
    }
    if (chosen.size() > 1) revise_sizes(options, chosen);
    for (const Chosen& c : chosen) {
      const float size = c.size * c.drawn.widest / c.drawn.spacing;
      const float px = std::min(size, std::max(1.0f, options.max_splat_px));
      const auto add = [&](int l, uint32_t first, uint32_t last) {
        if (first == last) return;
        DrawItem& item = out.items.emplace_back(make_item(*cluster, *c.mosaic, l, first, last));
        item.splat_px = std::max(px, 1.0f);
        item.radius_m = px * radius_m_of_px;
      };
      add(c.drawn.fine + 1, 0, c.drawn.mean);
      add(c.drawn.fine, c.drawn.mean, c.drawn.count);
      out.points += c.drawn.count;
      distance_sum += static_cast<double>(c.drawn.count) * view.distance;
    }
  }
  out.distance_m = out.points > 0 ? distance_sum / static_cast<double>(out.points) : 0.0;
}

}  // namespace telesplat::splat
