// Views in every schedule: they wait, are begun in turn, are complete or wait again. Each schedule cuts its frames in
// its own way.
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

/// Views in flight for the sake of one viewer's buffers, at most (T6.4: three buffers).
inline constexpr uint64_t kBufferedInFlight = 3;

/// Counts the rays that each person spends. Each guest's key is a person; all others together, and all without keys,
/// are one person.
class Spending {
 public:
  static constexpr double kHalfLife_s = 2;  ///< half-life of the rays spent
  static constexpr double kActive_s = 2;    ///< a person who asked for no view in this time wants none

  /// Notes a view request. person: the guest's key that let the viewer in; empty: not a guest.
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
  /// Returns the rays that the viewer's person spent lately.
  double spent(InstanceId viewer, double now_s) const {
    const auto found = people_.find(person(viewer));
    return found == people_.end() ? 0 : left(found->second, now_s);
  }
  /// True if another person than this viewer's asked for views within kActive_s.
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

  std::map<InstanceId, std::string> persons_;  // persons of guests
  std::map<std::string, Person> people_;
};

/// Returns the most views in flight if one of them is begun for a viewer that has `buffers` buffers.
size_t views_at_once(int frames_in_flight, uint64_t buffers);

/// View requests that wait at the master. Asynchronous viewers have one at most, their newest; the others (T6.4) have
/// one per buffer at most, in order. Viewers take turns; guests by the rays that their views cost.
class ViewQueue {
 public:
  /// A request with 0 buffers replaces the viewer's requests that wait. Another one waits behind them, or takes the
  /// place of the one with its id, and asynchronous ones of the viewer go; it is dropped if as many wait as the viewer
  /// has buffers (at most wire::kMaxBuffers).
  void add(const wire::ViewRequest& request);
  /// A view whose frame was dropped waits again, before all others of its viewer; not if it is asynchronous and another
  /// one waits, or if the newest that waits is asynchronous. Several are put back one by one, the newest first.
  void put_back(const wire::ViewRequest& request);
  void forget(InstanceId viewer) { viewers_.erase(viewer); }

  bool empty() const { return viewers_.empty(); }
  size_t waiting(InstanceId viewer) const;
  size_t waiting() const;  ///< sum over all viewers
  /// The viewer's first request; nullptr: no request waits.
  const wire::ViewRequest* first(InstanceId viewer) const;

  /// Gives a turn to each viewer that waits now; viewers that come later have no turn. A turn ends when a request of
  /// the viewer is taken.
  void begin_turns();
  bool turn_waiting() const;

  /// Returns the first request of the viewer that is next. turns_only: among viewers that have a turn; served: among
  /// viewers for which it is true; spent: the viewer with the least comes first. nullptr: no such viewer.
  const wire::ViewRequest* next(
      bool turns_only = false, const std::function<bool(InstanceId)>& served = [](InstanceId) { return true; },
      const std::function<double(InstanceId)>& spent = [](InstanceId) { return 0.0; }) const;
  /// Takes the first request of a viewer; the turn goes to the next viewer. Precondition: it has one.
  wire::ViewRequest take(InstanceId viewer);
  /// Takes the first request of each viewer if wanted() is true for it, at most `most`; the next viewer stays the same.
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
  double longest_fetch_s = 30.0;  ///< most time for a lease whose sampler asks for more
  double max_rate_mbit = 0;       ///< wished rate to each viewer; 0: as fast as its link carries
  double lease_target_s = 0.004;  ///< sampling time that a lease of rows should take
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
  /// Rays that persons have spent: they decide the turns.
  Spending& spending() { return spending_; }
  virtual void forget_viewer(InstanceId viewer);
  bool view_waiting() const { return !waiting_.empty(); }
  /// True if a view waits of a viewer for which of() is true.
  bool view_waits(const std::function<bool(InstanceId)>& of) const { return waiting_.next(false, of) != nullptr; }
  /// True if a view waits of a person who has no view in flight, while other persons have.
  bool another_waits() const;
  /// The viewer's first request that waits; nullptr: no request waits.
  const wire::ViewRequest* waiting_of(InstanceId viewer) const { return waiting_.first(viewer); }
  size_t views_waiting() const { return waiting_.waiting(); }
  /// See ViewQueue.
  void begin_turns() { waiting_.begin_turns(); }
  bool turn_waiting() const { return waiting_.turn_waiting(); }
  /// Number of views begun and not complete.
  size_t views_in_flight() const { return in_flight_.size(); }
  uint64_t frames_completed() const { return completed_; }  ///< frames of whole views

  /// This plan leads the session from now on: takes the views that wait in `from`, and continues its numbers of frames
  /// and leases. Precondition: `from` has no view in flight.
  void take_over(Views& from);

 protected:
  explicit Views(const ScheduleOptions& options) : options_(options) {}
  ~Views() = default;

  const ScheduleOptions& options() const { return options_; }
  FrameId next_frame();
  LeaseId next_lease();

  enum class InFlight { kAny, kOneAViewer };
  /// Takes the view to begin; viewers take turns. turns_only: among viewers that have a turn. kOneAViewer: among
  /// viewers without a view in flight. ready: among viewers for which it is true; null: all. Guests take turns by the
  /// rays they spend; each leaves a place for views of others, if others ask. nullopt: no view waits, or as many are in
  /// flight as views_at_once() allows.
  std::optional<wire::ViewRequest> take_view(bool turns_only, double now_s, InFlight allowed = InFlight::kAny,
                                             const std::function<bool(InstanceId)>& ready = {});
  const Spending& spending() const { return spending_; }
  /// More views for the same frame, as ViewQueue::take_all().
  std::vector<wire::ViewRequest> take_more(const std::function<bool(const wire::ViewRequest&)>& wanted, size_t most) {
    return waiting_.take_all(wanted, most);
  }
  /// `frame` shows these views: they are in flight until complete() or put_back().
  void begin(FrameId frame, const std::vector<wire::ViewRequest>& views);
  /// Ends a frame. whole: it counts as completed.
  void complete(FrameId frame, bool whole = true);
  /// The frame was dropped: its views wait again, except those of viewers that left; of asynchronous viewers only if no
  /// newer request does. Several are put back one by one, the newest first.
  void put_back(FrameId frame);
  /// True if all viewers whose views `frame` shows are gone. Precondition: it is in flight.
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
  std::vector<Begun> in_flight_;  // few: searched one by one
  FrameId next_frame_{1};
  LeaseId next_lease_{1};
  uint64_t completed_ = 0;
};

}  // namespace telesplat::master
