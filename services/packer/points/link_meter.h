// Measures how fast viewers receive what is published to all of them, and how much is on its way, from their receipts.
// No sockets, no clocks.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "common/core/ids.h"

namespace telesplat::packer {

/// Figures of one viewer's link, as of now.
struct LinkFigures {
  double rate_bytes_s = 0;     ///< throughput while it was busy; 0: not known, it was never seen busy
  uint64_t backlog_bytes = 0;  ///< published and not received
  double rtt_s = 0;            ///< least time from publishing to the receipt in the last 10 to 20 s; 0: not known
  /// Time since the last progress on a backlog; 0: no backlog.
  double oldest_s = 0;
};

class LinkMeter {
 public:
  static constexpr double kRttWindow_s = 10;  ///< length of a window for the least round trip
  /// With fewer bytes waiting, the time measures delays more than the link.
  static constexpr uint64_t kLeastBusyBytes = 16 << 10;
  static constexpr double kBusyEnough_s = 0.4;
  static constexpr double kRateWindow_s = 1;          ///< the rate is a mean over about this much busy time
  static constexpr size_t kMostRemembered = 1 << 16;  ///< events whose publishing is remembered
  static constexpr size_t kMostViewers = 256;
  static constexpr double kSilence_s = 10;  ///< a viewer silent for longer is forgotten

  /// An event went out to all viewers. Sequences rise.
  void published(Sequence sequence, uint64_t bytes, double now_s);
  /// A viewer reports that it has all events up to `newest`, at `viewer_s` on its own clock. A receipt that is not
  /// newer than an earlier one is not measured.
  void received(InstanceId viewer, Sequence newest, double viewer_s, double now_s);
  /// The viewer was sent all missing events anew: until it has them, the rise of its sequences measures no rate.
  void replayed(InstanceId viewer);
  /// Forgets viewers that fell silent.
  void expire(double now_s);
  /// Another model: sequences begin anew.
  void clear();

  /// nullopt: no receipt came from this viewer.
  std::optional<LinkFigures> figures(InstanceId viewer, double now_s) const;
  size_t viewers() const { return viewers_.size(); }
  /// Returns the rate of the slowest link among those busy for at least kBusyEnough_s lately: a viewer that
  /// took long over one view says little about its link. 0: unknown.
  double slowest_bytes_s() const;
  /// True if no link has more on its way than it carries in `most_s`, or (also where its rate is unknown) than `least`.
  bool all_free(double most_s, uint64_t least, double now_s) const;

 private:
  struct Published {
    Sequence sequence;
    uint64_t bytes_so_far;  // up to this event, inclusive
    double at_s;
  };
  struct Receipt {
    Sequence newest;
    uint64_t bytes_so_far = 0;
    double viewer_s = 0, arrived_s = 0;
  };
  struct Viewer {
    Receipt last;
    double busy_bytes = 0, busy_s = 0;  // both decay exponentially
    double least_rtt_s = 0, least_before_s = 0, window_from_s = 0;
    double moved_s = 0;       // when the viewer last received something new
    Sequence replayed_until;  // receipts up to this sequence belong to a replay
    double rtt_s() const;
  };
  std::deque<Published>::const_iterator find(Sequence sequence) const;
  void learn_rtt(Viewer& viewer, double rtt_s, double now_s);
  void learn_rate(Viewer& viewer, const Receipt& now, double published_s);

  std::deque<Published> published_;
  uint64_t bytes_ = 0, forgotten_bytes_ = 0;  // published in all; in events that are no longer remembered
  std::map<InstanceId, Viewer> viewers_;
  std::deque<std::pair<InstanceId, Sequence>> replays_;  // replays to viewers without a receipt yet, newest last
};

}  // namespace telesplat::packer
