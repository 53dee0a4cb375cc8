// What every schedule does with views: they wait, are begun in turn, are complete or wait again. What a frame is cut
// into is the schedule's own.
#pragma once

#include <cmath>
#include <deque>
#include <functional>
#include <map>
#include <optional>
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

/// View requests that wait at the master. Asynchronous viewers have one at most, their newest; the others (T6.4) have
/// as many in order as they have buffers. Viewers take turns; guests by the rays that their views cost.
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

inline constexpr int kCoarseStep = 4;  ///< a coarse frame has every 4th pixel of every 4th row

struct ScheduleOptions {
  int tile_size = 256;       ///< pixels a side; the last column and row may be smaller
  int frames_in_flight = 2;  ///< views begun and not complete, at most
  /// Longest time before a lease goes to another sampler; shorter once tile times are known.
  double lease_timeout_s = 2.0;
  double longest_fetch_s = 30.0;  ///< a sampler that says that it needs longer has a lease no longer than this
  double max_rate_mbit = 0;       ///< to each viewer, wished; 0: as much as its link carries
  double lease_target_s = 0.004;  ///< what a lease of rows should take its sampler
};

/// A mean in which each new value has the same share.
class RunningMean {
 public:
  explicit RunningMean(double share) : share_(share) {}
  void add(double value) { mean_ = mean_ == 0 ? value : (1 - share_) * mean_ + share_ * value; }
  bool known() const { return mean_ != 0; }
  double value() const { return mean_; }  ///< 0: nothing is known

 private:
  double share_, mean_ = 0;
};

class Views {
 public:
  /// As ViewQueue::add(). A buffered request whose view is in flight is not taken again.
  virtual void request_view(const wire::ViewRequest& request);
  /// Whose request it is, and whose turns they are.
  Spending& spending() { return spending_; }
  virtual void forget_viewer(InstanceId viewer);
  bool view_waiting() const { return !waiting_.empty(); }
  /// A view of a viewer waits for which this is true.
  bool view_waits(const std::function<bool(InstanceId)>& of) const { return waiting_.next(false, of) != nullptr; }
  /// A view waits of a person none of whose views is in flight, while those of another are.
  bool another_waits() const;
  /// Of this viewer, the first; nullptr: none.
  const wire::ViewRequest* waiting_of(InstanceId viewer) const { return waiting_.first(viewer); }
  size_t views_waiting() const { return waiting_.waiting(); }
  /// See ViewQueue.
  void begin_turns() { waiting_.begin_turns(); }
  bool turn_waiting() const { return waiting_.turn_waiting(); }
  /// Views begun and not complete.
  size_t views_in_flight() const { return in_flight_.size(); }
  uint64_t frames_completed() const { return completed_; }  ///< of whole views

  /// Another plan leads the session from now on: what waits there goes on here, and frames and leases are numbered
  /// on. Precondition: no view is in flight there.
  void take_over(Views& from);

 protected:
  explicit Views(const ScheduleOptions& options) : options_(options) {}
  ~Views() = default;

  const ScheduleOptions& options() const { return options_; }
  FrameId next_frame();
  LeaseId next_lease();

  enum class InFlight { kAny, kOneAViewer };
  /// The view to begin; viewers take turns. turns_only: only those that have a turn. kOneAViewer: only those that have
  /// no view in flight. nullopt: none waits, or as many are in flight as may be (views_at_once()).
  /// ready: only viewers for which it is true; null: all. Guests take turns by what they spend; one of them leaves a
  /// place for views of others, where others ask.
  std::optional<wire::ViewRequest> take_view(bool turns_only, double now_s, InFlight allowed = InFlight::kAny,
                                             const std::function<bool(InstanceId)>& ready = {});
  const Spending& spending() const { return spending_; }
  /// More views for the same frame, as ViewQueue::take_all().
  std::vector<wire::ViewRequest> take_more(const std::function<bool(const wire::ViewRequest&)>& wanted, size_t most) {
    return waiting_.take_all(wanted, most);
  }
  /// `frame` shows these views: they are in flight until complete() or put_back().
  void begin(FrameId frame, const std::vector<wire::ViewRequest>& views);
  /// whole: it counts as completed.
  void complete(FrameId frame, bool whole = true);
  /// The frame was dropped: its views wait again, except those of viewers that left; of asynchronous viewers only if no
  /// newer request does. Where several are put back, the newest comes first.
  void put_back(FrameId frame);
  /// All whose views `frame` shows are gone. Precondition: it is in flight.
  bool left(FrameId frame);

 private:
  struct Begun {
    FrameId frame;
    std::vector<wire::ViewRequest> views;
    std::vector<InstanceId> left;  // viewers that are gone
  };
  std::vector<Begun>::iterator find(FrameId frame);

  ScheduleOptions options_;
  bool leaves_a_place(InstanceId viewer, uint64_t buffers, double now_s) const;

  ViewQueue waiting_;
  Spending spending_;
  std::vector<Begun> in_flight_;  // few
  FrameId next_frame_{1};
  LeaseId next_lease_{1};
  uint64_t completed_ = 0;
};

}  // namespace telesplat::master
