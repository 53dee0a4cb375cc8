// Whether everybody stands still. No clocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "common/core/ids.h"
#include "common/geometry/camera.h"

namespace telesplat::packer {

class StillHeads {
 public:
  static constexpr double kStill_s = 0.3;              ///< without moving: then a head stands still
  static constexpr double kSilence_s = 10;             ///< without a view: then a viewer does not count
  static constexpr double kMove_m = 2e-3;              ///< trackers tremble by less
  static constexpr double kTurn_rad = 3.5e-3;          ///< 0.2 degrees
  static constexpr size_t kMostViewers = 256;

  /// A viewer wants a view from there.
  void seen(InstanceId viewer, const geometry::Pose& pose, double now_s) {
    if (heads_.size() >= kMostViewers && !heads_.contains(viewer)) return;
    Head& head = heads_.try_emplace(viewer, Head{pose, now_s, now_s}).first->second;
    head.seen_s = now_s;
    const double cosine = std::min(1.0, std::abs(glm::dot(head.pose.orientation, pose.orientation)));
    if (glm::distance(head.pose.position_room, pose.position_room) <= kMove_m && 2 * std::acos(cosine) <= kTurn_rad)
      return;
    head.pose = pose, head.moved_s = now_s;
  }
  /// For how long nobody has moved, s; nobody looks: for ever.
  double still_s(double now_s) {
    std::erase_if(heads_, [&](const auto& h) { return now_s - h.second.seen_s > kSilence_s; });
    double out = std::numeric_limits<double>::infinity();
    for (const auto& [viewer, head] : heads_) out = std::min(out, now_s - head.moved_s);
    return out;
  }
  bool still(double now_s) { return still_s(now_s) >= kStill_s; }

 private:
  struct Head {
    geometry::Pose pose;  // since it moved
    double moved_s, seen_s;
  };
  std::map<InstanceId, Head> heads_;
};

}  // namespace telesplat::packer
