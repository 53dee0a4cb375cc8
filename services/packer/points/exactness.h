// Decides which errors points may have, and when patches with errors become exact. No sockets, no clocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/wire/session_messages.h"
#include "services/packer/points/link_meter.h"
#include "services/packer/points/packer_core.h"

namespace telesplat::packer {

// Decides whether all heads stand still. No clocks.

class StillHeads {
 public:
  static constexpr double kStill_s = 0.3;      ///< a head that has not moved for this long stands still
  static constexpr double kSilence_s = 10;     ///< a viewer without requests for this long does not count
  static constexpr double kMove_m = 2e-3;      ///< tremble of trackers is less
  static constexpr double kTurn_rad = 3.5e-3;  ///< 0.2 degrees
  static constexpr size_t kMostViewers = 256;

  /// A viewer asks for a view from this pose.
  void seen(InstanceId viewer, const geometry::Pose& pose, double now_s) {
    if (heads_.size() >= kMostViewers && !heads_.contains(viewer)) return;
    Head& head = heads_.try_emplace(viewer, Head{pose, now_s, now_s}).first->second;
    head.seen_s = now_s;
    const double cosine = std::min(1.0, std::abs(glm::dot(head.pose.orientation, pose.orientation)));
    if (glm::distance(head.pose.position_room, pose.position_room) <= kMove_m && 2 * std::acos(cosine) <= kTurn_rad)
      return;
    head.pose = pose, head.moved_s = now_s;
  }
  /// Returns the time since any head moved, s; without viewers +infinity.
  double still_s(double now_s) {
    std::erase_if(heads_, [&](const auto& h) { return now_s - h.second.seen_s > kSilence_s; });
    double out = std::numeric_limits<double>::infinity();
    for (const auto& [viewer, head] : heads_) out = std::min(out, now_s - head.moved_s);
    return out;
  }
  bool still(double now_s) { return still_s(now_s) >= kStill_s; }

 private:
  struct Head {
    geometry::Pose pose;  // at the last movement
    double moved_s, seen_s;
  };
  std::map<InstanceId, Head> heads_;
};

class Exactness {
 public:
  /// Viewers' links are slow below this rate, and no longer slow from 9/8 of it; `auto` error options depend on it.
  static constexpr double kSlowLink_bytes_s = 5e6;
  /// The errors that `auto` allows with slow links.
  static constexpr AllowedErrors kSlowErrors{1.0 / 32, 1, 1};
  /// Refinement: while heads stand still, patches drawn within kDrawnLately_s become exact (viewers report once a
  /// second what they draw), unless a link has more under way than it carries in kBacklog_s, or than kBytes. kStep
  /// bytes at a time, since messages wait meanwhile.
  static constexpr double kDrawnLately_s = 3, kBacklog_s = 0.05, kPause_s = 1;
  /// Rays that views lack go first: patches become exact only when no such rays have come for kQuiet_s, or heads have
  /// stood still for kLongStill_s.
  static constexpr double kQuiet_s = 0.3, kLongStill_s = 10;
  static constexpr uint64_t kBytes = 32 << 10, kStep = 16 << 10;

  void follow(const wire::PointErrors& session) { session_ = session; }
  /// Returns the session's errors; those that are auto depend on LinkMeter::slowest_bytes_s().
  AllowedErrors allowed(double slowest_bytes_s) {
    slow_ = slowest_bytes_s > 0 && slowest_bytes_s < (slow_ ? 1.125 : 1) * kSlowLink_bytes_s;
    const AllowedErrors automatic = slow_ ? kSlowErrors : AllowedErrors{};
    const auto said = [](double value, auto otherwise) { return value < 0 ? otherwise : decltype(otherwise)(value); };
    return {said(session_.depth, automatic.depth_pixels), said(session_.normal, automatic.normal),
            said(session_.colour, automatic.colour)};
  }

  StillHeads& heads() { return heads_; }
  /// The model has points that it had not.
  void points_came(double now_s) { points_came_s_ = now_s; }
  /// Makes patches exact and publishes each, if it is time for that. Returns their bytes.
  uint64_t refine(PackerCore& core, const LinkMeter& links, double now_s,
                  const std::function<void(const Event&)>& publish) {
    under_way_ = false;
    if (now_s < next_s_ || !heads_.still(now_s)) return 0;
    if (now_s - points_came_s_ < kQuiet_s && heads_.still_s(now_s) < kLongStill_s) return 0;
    uint64_t bytes = 0;
    bool more = true;
    while (more && bytes < kStep && links.all_free(kBacklog_s, kBytes, now_s)) {
      const auto event = core.refine(now_s - kDrawnLately_s);
      if (!(more = event.has_value())) break;
      bytes += event->blob->size();
      publish(*event);
    }
    if (!more) next_s_ = now_s + kPause_s;
    under_way_ = bytes >= kStep;
    return bytes;
  }
  /// There is more to do at once.
  bool under_way() const { return under_way_; }

 private:
  wire::PointErrors session_;
  bool slow_ = false;  // some link is slow
  StillHeads heads_;
  double next_s_ = 0, points_came_s_ = -1e9;
  bool under_way_ = false;
};

}  // namespace telesplat::packer
