// Which views of a wall's viewers are sampled together, and when: those that were asked for of one head (Swap::ask), as
// one frame. A viewer that is late, stopped or gone does not hold up the others. No sockets, no clocks.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::master {

class WallViews {
 public:
  /// What viewers ask for together comes within this time. A frame begins without those who need longer.
  static constexpr double kTogether_s = 0.03;
  /// From a wall's first view until its views begin, if not all of its viewers ask sooner.
  static constexpr double kGather_s = 1;
  /// A viewer whose views belong to no frame of the others has one of its own after so long.
  static constexpr double kLeftOver_s = 0.25;
  /// A viewer that was late is waited for again after so many views in time.
  static constexpr int kInTime = 3;

  /// The first view of a viewer that waits; null: none does.
  using Waiting = std::function<const wire::ViewRequest*(InstanceId viewer)>;

  /// Whether it is for this class: an asynchronous view of a wall's viewer.
  static bool concerns(const wire::ViewRequest& view) { return !view.wall.empty() && view.buffers == 0; }
  /// A view that concerns it was asked for, at moments.received_s.
  void on(const wire::ViewRequest& view);
  void forget(InstanceId viewer);
  bool empty() const { return walls_.empty(); }
  /// Whether a frame may begin with this view, which waits and concerns it: with all others of together().
  bool ready(const wire::ViewRequest& view, const Waiting& waiting, double now_s) const;
  /// Whether another view that waits belongs to the frame that begins with `first`; both concern it.
  static bool together(const wire::ViewRequest& first, const wire::ViewRequest& other) {
    return other.wall == first.wall && other.ask == first.ask;
  }
  /// A frame of these views began; the first one concerns it, and was ready.
  void begun(const std::vector<wire::ViewRequest>& views);
  /// It was dropped: its views are together again.
  void dropped(const std::vector<wire::ViewRequest>& views);

 private:
  struct Member {
    bool waited_for = true;
    int in_time = 0;                // views in a row, while it is not waited for
    std::optional<double> since_s;  // it has had no view since then
  };
  struct Wall {
    uint64_t viewers = 1;
    double first_s = 0;      // of all of its views
    uint64_t ask = 0;        // the newest
    double since_s = 0;      // its first view came
    bool begun = false;      // its frame
    bool under_way = false;  // any frame began
    std::map<InstanceId, Member> members;
  };
  std::map<std::string, Wall> walls_;
};

}  // namespace telesplat::master
