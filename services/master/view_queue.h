// View requests that wait at the master. Asynchronous viewers have one at most, their newest; the others (T6.4) have as
// many in order as they have buffers. Viewers take turns; guests by the rays that their views cost.
#pragma once

#include <cmath>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::master {

inline constexpr uint64_t kBufferedInFlight =
    3;  ///< views in flight for the sake of one viewer's buffers, at most (T6.4: three buffers)

/// Guests are told apart by their keys. Everybody else, and everybody where there are no keys, is one person.
class Spending {
 public:
  static constexpr double kHalfLife_s = 2;  ///< of what was spent
  static constexpr double kActive_s = 2;    ///< a person who asked for nothing for so long wants nothing

  /// A view of this viewer, whom the guest's key `person` let in; empty: no guest.
  void asked(InstanceId viewer, const std::string& person, double now_s) {
    if (person.empty())
      persons_.erase(viewer);
    else
      persons_[viewer] = person;
    people_[person].asked_s = now_s;
    std::erase_if(people_, [&](const auto& p) { return now_s - p.second.asked_s > kForgotten_s; });
  }
  void forget(InstanceId viewer) { persons_.erase(viewer); }
  void spend(InstanceId viewer, double rays, double now_s) {
    Person& p = people_[person(viewer)];
    p = {p.asked_s, left(p, now_s) + rays, now_s};
  }

  const std::string& person(InstanceId viewer) const {
    static const std::string kNoGuest;
    const auto found = persons_.find(viewer);
    return found == persons_.end() ? kNoGuest : found->second;
  }
  /// Rays lately.
  double spent(InstanceId viewer, double now_s) const {
    const auto found = people_.find(person(viewer));
    return found == people_.end() ? 0 : left(found->second, now_s);
  }
  /// Somebody else than this viewer's person asks for views, too.
  bool others_ask(InstanceId viewer, double now_s) const {
    for (const auto& [name, p] : people_)
      if (name != person(viewer) && now_s - p.asked_s < kActive_s) return true;
    return false;
  }

 private:
  static constexpr double kForgotten_s = 60;
  struct Person {
    double asked_s = -1e300, rays = 0, at_s = 0;
  };
  static double left(const Person& p, double now_s) { return p.rays * std::exp2((p.at_s - now_s) / kHalfLife_s); }

  std::map<InstanceId, std::string> persons_;  // of guests
  std::map<std::string, Person> people_;
};

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
  /// it is true; spent: who has spent least comes first. nullptr: none.
  const wire::ViewRequest* next(
      bool turns_only = false, const std::function<bool(InstanceId)>& served = [](InstanceId) { return true; },
      const std::function<double(InstanceId)>& spent = [](InstanceId) { return 0.0; }) const;
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
