#include "common/points/refinement.h"

#include <map>
#include <unordered_map>
#include <utility>

#include "common/core/check.h"
#include "common/points/compaction.h"
#include "common/points/unproject.h"

namespace telesplat::points {
namespace {

// One row of an image, unprojected.
struct UnprojectedRow {
  std::vector<ClusterKey> keys;
  std::vector<uint16_t> x, y, z;

  void set(const RowRays& rays, const image::DepthImage& image, int row) {
    const auto n = static_cast<size_t>(image.width);
    keys.resize(n), x.resize(n), y.resize(n), z.resize(n);
    unproject_row(rays, image.depth.data() + static_cast<size_t>(row) * n, n, keys.data(),
                  {x.data(), y.data(), z.data()});
  }
};

// Returns a position along one axis in leaf `from`, for a point that lies in leaf `to`: on the side between them.
uint16_t within(ClusterKey from, ClusterKey to, int axis, uint16_t q) {
  const uint32_t a = from >> (10 * axis) & 1023, b = to >> (10 * axis) & 1023;
  return a == b ? q : a < b ? uint16_t{65535} : uint16_t{0};
}

struct HashOfPoint {
  size_t operator()(const LeafPoint& p) const {
    const uint64_t position = uint64_t{p.x} | uint64_t{p.y} << 16 | uint64_t{p.z} << 32 | uint64_t{p.normal} << 48;
    return (position ^ uint64_t{p.colour} * 0xff51afd7ed558ccdull) * 0x9e3779b97f4a7c15ull >> 16;
  }
};

// Finds the exact point of a bounded one. Equal bounded points are taken in order.
class ExactPoints {
 public:
  explicit ExactPoints(const PreparedRefinement::Part& part) : part_(part), next_(part.bounded.size(), kNone) {
    for (uint32_t i = static_cast<uint32_t>(part.bounded.size()); i-- > 0;) {
      const auto [place, fresh] = first_.try_emplace(part.bounded[i], i);
      if (!fresh) next_[i] = std::exchange(place->second, i);
    }
  }
  // Null: no point matches, or all matching ones are used.
  const LeafPoint* take(const LeafPoint& bounded) {
    const auto found = first_.find(bounded);
    if (found == first_.end() || found->second == kNone) return nullptr;
    return &part_.exact[std::exchange(found->second, next_[found->second])];
  }

 private:
  static constexpr uint32_t kNone = ~0u;
  const PreparedRefinement::Part& part_;
  std::unordered_map<LeafPoint, uint32_t, HashOfPoint> first_;
  std::vector<uint32_t> next_;
};

}  // namespace

uint64_t PreparedRefinement::points() const {
  uint64_t n = 0;
  for (const Part& part : parts) n += part.bounded.size();
  return n;
}

PreparedRefinement prepare_refinement(const ModelConfig& config, Sequence sequence, Sequence of,
                                      const RefinedPatch& patch) {
  const auto& [camera, tile, bounded, exact, frame] = patch;
  CHECK(tile.width == bounded.width && tile.height == bounded.height);
  CHECK(tile.width == exact.width && tile.height == exact.height);
  const OctreeGrid grid = octree_grid(config);
  std::map<ClusterKey, PreparedRefinement::Part> parts;
  UnprojectedRow before, after;
  for (int row = 0; row < tile.height; ++row) {
    const RowRays rays = row_rays(grid, camera, tile.x, tile.y + row);
    before.set(rays, bounded, row);
    after.set(rays, exact, row);
    for (int column = 0; column < tile.width; ++column) {
      const auto i = static_cast<size_t>(column), pixel = static_cast<size_t>(row) * tile.width + i;
      const ClusterKey key = before.keys[i], to = after.keys[i];
      if (key == kNoCluster || exact.depth[pixel] == 0) continue;
      const LeafPoint was{before.x[i], before.y[i], before.z[i], bounded.normal[pixel], bounded.colour[pixel]};
      LeafPoint is{was.x, was.y, was.z, exact.normal[pixel], exact.colour[pixel]};
      if (to != kNoCluster)
        is.x = within(key, to, 0, after.x[i]), is.y = within(key, to, 1, after.y[i]),
        is.z = within(key, to, 2, after.z[i]);
      if (was == is) continue;
      auto& part = parts[key];
      part.bounded.push_back(was), part.exact.push_back(is);
    }
  }
  PreparedRefinement out{sequence, of, group_of(static_cast<uint32_t>(frame.value)), {}};
  out.parts.reserve(parts.size());
  for (auto& [key, part] : parts) {
    part.key = key;
    out.parts.push_back(std::move(part));
  }
  return out;
}

Insertion plan_refinement(const PointModel& model, const PreparedRefinement& refinement) {
  Insertion out{refinement.sequence, {}};
  for (const PreparedRefinement::Part& part : refinement.parts) {
    const Cluster* cluster = model.find(part.key);
    if (!cluster) continue;
    Insertion::Change change{part.key, {}, {}, {}};
    ExactPoints exact(part);
    std::vector<std::pair<uint32_t, LeafPoint>> found;
    for (uint32_t m = 0; m < cluster->mosaics.size(); ++m) {
      const Mosaic& mosaic = cluster->mosaics[m];
      // A merged mosaic has the newest sequence of its parts, so an older mosaic has no point of that patch.
      if (mosaic.sequence() < refinement.of || mosaic.group() != refinement.group) continue;
      const Mosaic::Level l = mosaic.level(0);
      found.clear();
      for (uint32_t i = 0; i < l.count; ++i)
        if (const LeafPoint* to = exact.take({l.x[i], l.y[i], l.z[i], l.normal[i], l.colour[i]}))
          found.emplace_back(i, *to);
      if (!found.empty()) change.renewed.emplace_back(m, with_points(mosaic, found));
    }
    if (!change.renewed.empty()) out.changes.push_back(std::move(change));
  }
  return out;
}

}  // namespace telesplat::points
