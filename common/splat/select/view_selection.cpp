#include "common/splat/select/view_selection.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/geometry/stereo.h"
#include "common/image/normal.h"
#include "common/splat/facing.h"
#include "common/splat/select/cluster_walk.h"
#include "common/splat/select/level_choice.h"
#include "common/splat/select/patch_choice.h"

namespace telesplat::splat {
namespace {

// A mosaic chosen from the current cluster, before its size is final.
struct Chosen {
  const points::Mosaic* mosaic;
  Drawn drawn;
  float size;      // splat size by T eq. 4.8 for evenly spread points, not clamped
  float coverage;  // share of the leaf's face that its points cover: points * (sample size / leaf size)^2
  bool may_face_away;
};

// 0 up to `from`, rising to 1 at `to`.
float ramp(float x, float from, float to) { return std::clamp((x - from) / (to - from), 0.0f, 1.0f); }

// T4.4.3: splats of a low-rate mosaic shrink if they would hide high-rate ones. We deviate in two points. After
// redundancy elimination a low-rate mosaic may be the only one in most of the cluster, and a handful of high-rate
// points elsewhere in it would tear holes. So splats shrink only if mosaics of higher rate cover at least as much of
// the cluster as the low-rate one does. And sizes do not jump: they change over a quarter of the height of the two
// thresholds.
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

// A pseudo-random number in [0, 1) for each mosaic, the same in every frame.
float dither_of(points::ClusterKey key, const points::Mosaic& m) {
  const uint64_t h = (m.sequence().value << 32 ^ key) * 0x9e3779b97f4a7c15ull;
  return static_cast<float>(h >> 40) * 0x1p-24f;
}

// Lists the patches of the mosaics that are drawn from a cluster.
void note_patches(points::ClusterKey key, const std::vector<const points::Mosaic*>& drawn, DrawList& out) {
  const auto first = static_cast<ptrdiff_t>(out.frames_seen.size());
  for (const points::Mosaic* m : drawn) {
    const uint32_t frame = m->frame_tag();
    if (std::find(out.frames_seen.begin() + first, out.frames_seen.end(), frame) != out.frames_seen.end()) continue;
    out.clusters_seen.push_back(key);
    out.frames_seen.push_back(frame);
  }
}

// Makes an item of points [first, last) of a mosaic's level.
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

// A summary is wanted anew once its brick has changed more often than this. Until then the mosaics that it lacks are
// drawn whole, beside it.
constexpr uint64_t kStaleChanges = 16;

// One walk over a model.
class Selector {
 public:
  Selector(const geometry::Camera& camera, const SelectionOptions& options, DrawList& out)
      : options_(options),
        out_(out),
        eye_(camera.pose.position_room),
        backward_(camera.pose.orientation * glm::dvec3(0, 0, 1)),
        position_(camera.pose.position_room),
        focal_(camera.focal_x()),
        patches_(patch_view(camera)) {
    if (options.eyes)
      for (const geometry::Camera& eye : *options.eyes) eyes_.emplace_back(eye.pose.position_room);
    else
      eyes_.push_back(eye_);
    views_.resize(eyes_.size());
  }

  /// Adds the brick's summary and the mosaics that it lacks. False: its clusters must be drawn.
  bool add_summary(const SeenBrick& seen, const geometry::Frustum& frustum, const points::Summaries& summaries) {
    const points::Brick& brick = *seen.brick;
    const float range = pixel_range(brick.box_room, double{brick.box_room.hi.x} - double{brick.box_room.lo.x});
    if (range > points::kMostSummaryRange) return false;
    const auto found = summaries.find(seen.key);
    const points::Summary* summary = found == summaries.end() ? nullptr : found->second.get();
    const bool valid = summary && summary->removals == brick.removals, fits = valid && range <= summary->most_range;
    // One that does not fit may do so once the brick is sampled more finely, which takes many changes.
    const uint64_t most_changes = fits ? kStaleChanges : kStaleChanges + brick.changes / 2;
    if (!valid || brick.changes - summary->changes > most_changes) out_.summaries_wanted.push_back(seen.key);
    if (!fits) return false;
    add(summary->cluster);
    out_.clusters_seen.pop_back();
    for_seen_clusters(seen, frustum, [&](const points::Cluster& cluster) {
      if (brick.changes == summary->changes)
        out_.clusters_seen.push_back(cluster.key);
      else
        add(cluster, summary->built);
    });
    return true;
  }

  /// after: leaves out mosaics of this event and of earlier ones.
  void add(const points::Cluster& cluster, Sequence after = {}) {
    const geometry::Box& leaf = cluster.leaf_room;
    const float leaf_m = leaf.hi.x - leaf.lo.x;
    const float range = pixel_range(leaf, double{leaf_m});
    choose_mosaics(cluster, after);
    chosen_.clear();
    for (const Visible& v : visible_) {
      const points::Mosaic& m = *v.mosaic;
      const float ratio = range / m.pixel_range(), wanted = options_.detail * std::min(ratio, 1.0f);
      const Drawn drawn =
          options_.transitions ? between_levels(m, wanted, dither_of(cluster.key, m)) : closest_level(m, wanted);
      chosen_.push_back({&m, drawn, options_.scale * ratio * drawn.spacing,
                         static_cast<float>(m.count(0)) / (m.pixel_range() * m.pixel_range()), v.may_face_away});
    }
    if (chosen_.size() > 1) revise_sizes(options_, chosen_);
    for (const Chosen& c : chosen_) add(cluster, c, 0.5f * leaf_m / range, views_.front().distance);
  }

  double distance_sum() const { return distance_sum_; }

 private:
  struct Visible {
    const points::Mosaic* mosaic;
    bool may_face_away;
  };

  // points::pixel_range, with the figures that all leaves share computed once.
  float pixel_range(const geometry::Box& leaf, double leaf_m) const {
    const double depth = glm::dot(position_ - glm::dvec3(leaf.centre()), backward_);
    return static_cast<float>(leaf_m * focal_ / std::max(depth, 0.5 * leaf_m));
  }

  // Points of a mosaic that only one of two eyes might see are tested one by one when they are drawn.
  Facing facing(const points::Mosaic& m) const {
    if (!options_.cone_culling) return Facing::kTowards;
    const Facing first = facing_of(m, views_.front());
    for (size_t i = 1; i < views_.size(); ++i)
      if (facing_of(m, views_[i]) != first) return Facing::kMixed;
    return first;
  }

  void choose_mosaics(const points::Cluster& cluster, Sequence after) {
    visible_.clear();
    for (size_t i = 0; i < views_.size(); ++i) views_[i] = leaf_view(cluster.leaf_room, eyes_[i]);
    for (const points::Mosaic& m : cluster.mosaics) {
      if ((after.value != 0 && m.sequence() <= after) || (m.of_rest() && !options_.rests)) continue;
      const Facing facing = this->facing(m);
      if (facing != Facing::kAway) visible_.push_back({&m, facing == Facing::kMixed});
    }
    if (!options_.best_patch_only) return out_.clusters_seen.push_back(cluster.key);
    candidates_.clear();
    for (const Visible& v : visible_) candidates_.push_back(v.mosaic);
    chooser_.choose(cluster.leaf_room, patches_, candidates_);
    note_patches(cluster.key, candidates_, out_);
    // Both lists are in the cluster's order.
    auto next = candidates_.begin();
    std::erase_if(visible_, [&](const Visible& v) {
      if (next == candidates_.end() || *next != v.mosaic) return true;
      ++next;
      return false;
    });
  }

  void add(const points::Cluster& cluster, const Chosen& c, float radius_m_of_px, float distance) {
    const float size = c.size * c.drawn.widest / c.drawn.spacing;
    const float px = std::min(size, std::max(1.0f, options_.max_splat_px));
    const auto add_points = [&](int l, uint32_t first, uint32_t last) {
      if (first == last) return;
      DrawItem& item = out_.items.emplace_back(make_item(cluster, *c.mosaic, l, first, last));
      item.splat_px = std::max(px, 1.0f);
      item.radius_m = px * radius_m_of_px;
      item.may_face_away = c.may_face_away;
    };
    add_points(c.drawn.fine + 1, 0, c.drawn.mean);
    add_points(c.drawn.fine, c.drawn.mean, c.drawn.count);
    out_.points += c.drawn.count;
    distance_sum_ += static_cast<double>(c.drawn.count) * static_cast<double>(distance);
  }

  const SelectionOptions& options_;
  DrawList& out_;
  const glm::vec3 eye_;
  const glm::dvec3 backward_, position_;
  const double focal_;
  const PatchView patches_;
  std::vector<glm::vec3> eyes_;  // eyes that points may face: the camera's, or those of SelectionOptions::eyes
  std::vector<LeafView> views_;  // views of the current cluster, from each eye
  PatchChooser chooser_;
  std::vector<Visible> visible_;
  std::vector<const points::Mosaic*> candidates_;
  std::vector<Chosen> chosen_;
  double distance_sum_ = 0;
};

}  // namespace

bool faces_away(const points::Mosaic& mosaic, const geometry::Box& leaf_room, const glm::vec3& eye_room) {
  return facing_of(mosaic, leaf_view(leaf_room, eye_room)) == Facing::kAway;
}

uint64_t names_of(const DrawList& list) {
  uint64_t hash = list.replica;
  for (const DrawItem& item : list.items) {
    const struct {
      uint64_t sequence;
      uint32_t key, first, count;
      float splat_px;
    } name{item.sequence.value, item.cluster->key, item.first, item.level.count, item.splat_px};
    hash = XXH3_64bits_withSeed(&name, sizeof name, hash);
  }
  return list.base ? hash ^ list.base->number << 32 : hash;
}

void select_view(const points::PointModel& model, const geometry::Camera& camera, const SelectionOptions& options,
                 DrawList& out, const points::Summaries* summaries) {
  out.items.clear();
  out.summaries_wanted.clear();
  out.clusters_seen.clear();
  out.frames_seen.clear();
  out.points = 0;
  out.scale = options.scale;
  const geometry::Frustum frustum(options.eyes ? geometry::enclosing_camera(*options.eyes) : camera);
  Selector selector(camera, options, out);
  for (const SeenBrick& seen : seen_bricks(model, frustum, glm::vec3(camera.pose.position_room))) {
    if (summaries && !options.best_patch_only && selector.add_summary(seen, frustum, *summaries)) continue;
    for_seen_clusters(seen, frustum, [&](const points::Cluster& cluster) { selector.add(cluster); });
  }
  out.distance_m = out.points > 0 ? selector.distance_sum() / static_cast<double>(out.points) : 0.0;
}

}  // namespace telesplat::splat
