// How fast viewers receive what is published to all of them, and how much is on its way: from what they say they have.
// No sockets, no clocks.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "common/core/ids.h"

namespace telesplat::packer {

/// Of one viewer's link, now.
struct LinkFigures {
  double rate_bytes_s = 0;     ///< what it carried when it was busy; 0: it never was, as far as is known
  uint64_t backlog_bytes = 0;  ///< published and not received
  double rtt_s = 0;            ///< from publishing to the receipt, at least, in the last 10 to 20 s; 0: not known
  /// How long it has had a backlog and received nothing of it; 0: there is none.
  double oldest_s = 0;
};

class LinkMeter {
 public:
  static constexpr double kRttWindow_s = 10;  ///< for the least round trip, and the window before
  /// Of less that waits, the time tells of delays more than of the link.
  static constexpr uint64_t kLeastBusyBytes = 16 << 10;
  static constexpr double kBusyEnough_s = 0.4;
  static constexpr double kRateWindow_s = 1;          ///< busy time that the rate is a mean of, about
  static constexpr size_t kMostRemembered = 1 << 16;  ///< events whose publishing is remembered
  static constexpr size_t kMostViewers = 256;
  static constexpr double kSilence_s = 10;  ///< then a viewer is forgotten

  /// An event went out to all viewers. Sequences rise.
  void published(Sequence sequence, uint64_t bytes, double now_s);
  /// A viewer says that it has everything up to `newest`, at `viewer_s` of its own clock. What is not newer than an
  /// earlier receipt tells nothing.
  void received(InstanceId viewer, Sequence newest, double viewer_s, double now_s);
  /// It was sent anew what it lacks, as far as is published: how fast sequences rise until then tells nothing.
  void replayed(InstanceId viewer);
  /// Forgets viewers that fell silent.
  void expire(double now_s);
  /// Sequences begin anew: another model.
  void clear();

  /// nullopt: it has said nothing.
  std::optional<LinkFigures> figures(InstanceId viewer, double now_s) const;
  size_t viewers() const { return viewers_.size(); }
  /// Of the slowest link of those that were busy for kBusyEnough_s lately: that a viewer took long to look at one view
  /// tells little of its link. 0: of none.
  double slowest_bytes_s() const;
  /// No link has more on its way than it carries in `most_s`, or `least` bytes; where its rate is not known, `least`.
  bool all_free(double most_s, uint64_t least, double now_s) const;

 private:
  struct Published {
    Sequence sequence;
    uint64_t bytes_so_far;  // this one included
    double at_s;
  };
  struct Receipt {
    Sequence newest;
    uint64_t bytes_so_far = 0;
    double viewer_s = 0, arrived_s = 0;
  };
  struct Viewer {
    Receipt last;
    double busy_bytes = 0, busy_s = 0;  // decaying
    double least_rtt_s = 0, least_before_s = 0, window_from_s = 0;
    double moved_s = 0;       // when it had something new
    Sequence replayed_until;  // up to here sequences are those of a replay
    double rtt_s() const;
  };
  std::deque<Published>::const_iterator find(Sequence sequence) const;
  void learn_rtt(Viewer& viewer, double rtt_s, double now_s);
  void learn_rate(Viewer& viewer, const Receipt& now, double published_s);

  std::deque<Published> published_;
  uint64_t bytes_ = 0, forgotten_bytes_ = 0;  // published in all; of events that are not remembered
  std::map<InstanceId, Viewer> viewers_;
  std::deque<std::pair<InstanceId, Sequence>> replays_;  // of viewers that have given no receipt yet, newest last
};

}  // namespace telesplat::packer
