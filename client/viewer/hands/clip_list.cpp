#include "client/viewer/hands/clip_list.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace telesplat::viewer {
namespace {

using Part = geometry::Clip::Part;

// Kernels read whole vectors beyond the last points of a level.
constexpr size_t kPadding = 64;

struct Copy {
  std::vector<uint16_t> shorts;  // x, y, z, normal
  std::vector<uint32_t> colours;
};

// The planes in a leaf's own steps: a point (x, y, z) stays if a x + b y + c z >= least.
struct LeafPlanes {
  struct Plane {
    float a, b, c, least;
  };
  std::vector<Plane> planes;

  LeafPlanes(const geometry::Clip& clip, const geometry::Box& leaf) {
    const double step = (double{leaf.hi.x} - double{leaf.lo.x}) / 65536;
    const glm::dvec3 first = glm::dvec3(leaf.lo) + glm::dvec3(0.5 * step);
    for (const geometry::ClipPlane& p : clip.planes) {
      const glm::dvec3 n = p.normal * step;
      planes.push_back({float(n.x), float(n.y), float(n.z), float(-p.inside_m(first) - step)});
    }
  }
  bool keeps(uint16_t x, uint16_t y, uint16_t z) const {
    return std::all_of(planes.begin(), planes.end(),
                       [&](const Plane& p) { return p.a * x + p.b * y + p.c * z >= p.least; });
  }
};

// Copies the points of the item that stay, and returns their number. If all stay, nothing changes.
uint32_t keep_inside(const LeafPlanes& planes, splat::DrawItem& item, splat::DrawList& list) {
  const points::Mosaic::Level& from = item.level;
  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < from.count; ++i)
    if (planes.keeps(from.x[i], from.y[i], from.z[i])) kept.push_back(i);
  if (kept.size() == from.count || kept.empty()) return uint32_t(kept.size());
  const size_t pitch = kept.size() + kPadding;
  auto copy = std::make_shared<Copy>();
  copy->shorts.assign(4 * pitch, 0);
  copy->colours.assign(pitch, 0);
  for (size_t n = 0; n < kept.size(); ++n) {
    const uint32_t i = kept[n];
    copy->shorts[n] = from.x[i], copy->shorts[pitch + n] = from.y[i];
    copy->shorts[2 * pitch + n] = from.z[i], copy->shorts[3 * pitch + n] = from.normal[i];
    copy->colours[n] = from.colour[i];
  }
  const uint16_t* shorts = copy->shorts.data();
  item.level = {uint32_t(kept.size()), shorts, shorts + pitch, shorts + 2 * pitch, shorts + 3 * pitch,
                copy->colours.data()};
  item.first = item.of = 0;
  item.sequence = {};  // renderers keep no copies of this item
  list.held.push_back(std::move(copy));
  return item.level.count;
}

}  // namespace

void clip_list(const geometry::Clip& clip, splat::DrawList& list) {
  list.held.clear();
  list.base_clip = clip;
  if (clip.empty()) return;
  const points::Cluster* cluster = nullptr;
  Part part = Part::kAll;
  std::optional<LeafPlanes> planes;  // the planes on the cluster's steps
  list.points = 0;
  std::erase_if(list.items, [&](splat::DrawItem& item) {
    if (std::exchange(cluster, item.cluster) != item.cluster) {
      part = clip.part_of(cluster->leaf_room);
      if (part == Part::kSome) planes.emplace(clip, cluster->leaf_room);
    }
    const uint32_t count = part == Part::kNone  ? 0
                           : part == Part::kAll ? item.level.count
                                                : keep_inside(*planes, item, list);
    list.points += count;
    return count == 0;
  });
}

}  // namespace telesplat::viewer
