#include "services/sampler/mesh/cut.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <tuple>

namespace telesplat::sampler {
namespace {

using geometry::ChunkInfo;

class Chooser {
 public:
  Chooser(const std::vector<ChunkInfo>& tree, const geometry::Camera& camera, const geometry::Frustum& part,
          const std::function<bool(ChunkId)>& held)
      : tree_(tree),
        eye_(camera.pose.position_room),
        pixel_(1 / std::max(camera.focal_x(), camera.focal_y())),
        part_(part),
        held_(held) {}

  Cut choose() {
    std::vector<bool> below(tree_.size());
    for (const ChunkInfo& c : tree_)
      for (uint32_t i = 0; i < c.children; ++i) below[c.first_child + i] = true;
    for (size_t i = tree_.size(); i-- > 0;)
      if (!below[i] && !show(tree_[i])) cut_.whole = false;
    std::sort(missing_.begin(), missing_.end());
    for (const auto& [coarseness, distance, id] : missing_) cut_.missing.push_back(id);
    std::sort(cut_.shown.begin(), cut_.shown.end());
    return std::move(cut_);
  }

 private:
  double distance_m(const ChunkInfo& c) const {
    return glm::distance(glm::clamp(eye_, glm::dvec3(c.box_room.lo), glm::dvec3(c.box_room.hi)), eye_);
  }

  void miss(const ChunkInfo& c, double distance) { missing_.emplace_back(-c.spacing_m, distance, c.id); }

  // Shows a chunk, or those below it. False: nothing that is held stands for it.
  bool show(const ChunkInfo& c) {
    if (!part_.may_contain(c.box_room)) return true;
    const double distance = distance_m(c);
    const bool belongs = c.is_leaf() || double{c.spacing_m} <= kMostSpacing * pixel_ * distance;
    const bool is_held = held_(c.id);
    if (belongs) {
      is_held ? cut_.shown.push_back(c.id) : miss(c, distance);
      cut_.fine &= is_held;
      return is_held;
    }
    const size_t shown = cut_.shown.size();
    bool all = true;
    for (uint32_t i = 0; i < c.children; ++i) all &= show(tree_[c.first_child + i]);
    if (all) return true;
    if (!is_held) return miss(c, distance), false;
    cut_.shown.resize(shown);
    cut_.shown.push_back(c.id);
    return true;
  }

  const std::vector<ChunkInfo>& tree_;
  const glm::dvec3 eye_;
  const double pixel_;  // its size at a distance of 1
  const geometry::Frustum& part_;
  const std::function<bool(ChunkId)>& held_;
  Cut cut_;
  std::vector<std::tuple<float, double, ChunkId>> missing_;
};

}  // namespace

Cut choose_cut(const std::vector<ChunkInfo>& tree, const geometry::Camera& camera, const geometry::Frustum& part,
               const std::function<bool(ChunkId)>& held) {
  return Chooser(tree, camera, part, held).choose();
}

}  // namespace telesplat::sampler
