// View requests that wait at the master. Asynchronous viewers have one at most, their newest; the others (T6.4) have as
// many in order as they have buffers. Viewers take turns.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::master {

inline constexpr uint64_t kBufferedInFlight =
    3;  ///< views in flight for the sake of one viewer's buffers, at most (T6.4: three buffers)

/// How many views may be in flight when one is begun for a viewer that has `buffers` buffers.
size_t views_at_once(int frames_in_flight, uint64_t buffers);

class ViewQueue {
 public:
  /// buffers 0: it replaces the viewer's requests that wait. Otherwise it waits behind them, or takes the place of the
  /// one with its id, and asynchronous ones of the viewer go. It is dropped where as many wait as the viewer has
  /// buffers (at most wire::kMaxBuffers).
  void add(const wire::ViewRequest& request);
  /// The view was begun and its frame dropped: it waits again, before all others of its viewer; not at all if it is
  /// asynchronous and a newer one waits. Where several are put back, the newest comes first.
  void put_back(const wire::ViewRequest& request);
  void forget(InstanceId viewer) { viewers_.erase(viewer); }

  bool empty() const { return viewers_.empty(); }
  size_t waiting(InstanceId viewer) const;
  size_t waiting() const;  ///< of all viewers
  /// The viewer's first request; nullptr: none waits.
  const wire::ViewRequest* first(InstanceId viewer) const;

  /// The viewers that wait now have a turn; those who come later have none. A turn ends when a request of the viewer is
  /// taken.
  void begin_turns();
  bool turn_waiting() const;

  /// Whose turn it is: its first request. turns_only: only of viewers that have a turn; served: only of those for which
  /// it is true. nullptr: none.
  const wire::ViewRequest* next(
      bool turns_only = false, const std::function<bool(InstanceId)>& served = [](InstanceId) { return true; }) const;
  /// Takes the first request of a viewer; the turn goes to the next viewer. Precondition: it has one.
  wire::ViewRequest take(InstanceId viewer);
  /// Takes the first requests of all viewers where they are wanted, `most` at most; nobody's turn changes.
  std::vector<wire::ViewRequest> take_all(const std::function<bool(const wire::ViewRequest&)>& wanted, size_t most);

 private:
  struct Viewer {
    std::deque<wire::ViewRequest> requests;  // not empty
    bool turn = false;
  };
  std::map<InstanceId, Viewer> viewers_;
  InstanceId last_;
};

}  // namespace telesplat::master
