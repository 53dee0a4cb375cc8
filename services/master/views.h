// What every schedule does with views: they wait, are begun in turn, are complete or wait again. What a frame is cut
// into is the schedule's own.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "services/master/view_queue.h"

namespace telesplat::master {

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
