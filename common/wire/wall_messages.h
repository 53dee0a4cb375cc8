// Messages of a wall, whose viewers present their frames together: between each of them (DEALER, over a connection of
// its own) and the master (ROUTER).
#pragma once

#include <string>
#include <string_view>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/wire/limits.h"

namespace telesplat::wire {

inline constexpr uint64_t kMaxWallViewers = 256;  ///< viewers of one wall

// Structs and their fields() stand as tables.
// clang-format off

/// Part of the data set that a viewer shows, or could show.
struct ShownState {
  InstanceId source;     ///< process that gives the numbers: the packer for points, the master for slice frames
  uint64_t newest = 0;   ///< points: Sequence of the newest event; slices: FrameId
  uint64_t replica = 0;  ///< points: one more than the Sequence with which the replica on display began; 0: none
  uint64_t held = 0;     ///< slices: bit n: the viewer has the frame `newest` - n too; 0: not reported
  bool operator==(const ShownState&) const = default;
  template <class F> static void fields(F& f, auto& m) {
    f("source", m.source); f("newest", m.newest); f("replica", m.replica); f("held", m.held);
  }
};

/// Viewer -> master: a frame of the wall is drawn and may be presented; sent again until an answer comes.
struct SwapReady {
  static constexpr std::string_view kName = "swap_ready";
  InstanceId viewer;
  std::string wall;         ///< name of the wall: viewers that state the same name swap together
  uint64_t number = 0;      ///< the viewer's number in the wall; the head of the least counts for all
  uint64_t viewers = 1;     ///< viewers that the wall has, at most kMaxWallViewers
  uint64_t frame = 0;       ///< frame that is drawn; 0: none yet
  double t_s = 0;           ///< time of the next frame, on the clock of the head's movement
  geometry::Pose head;      ///< pose at that time
  ShownState state;         ///< the newest that the next frame could show
  double period_s = 0;      ///< least time between two frames
  uint64_t presented = 0;   ///< the frame that was presented last; 0: none yet
  double presented_s = 0;   ///< time of that
  double late_s = 0;        ///< seconds after its time that the order to present it arrived
  bool asks = false;        ///< the viewer asks that all viewers now request views
  geometry::Pose ahead;     ///< expected pose of the head when those views arrive
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("wall", m.wall); f("number", m.number); f("viewers", m.viewers); f("frame", m.frame);
    f("t_s", m.t_s); f("head", m.head); f("state", m.state); f("period_s", m.period_s);
    f("presented", m.presented); f("presented_s", m.presented_s); f("late_s", m.late_s);
    f("asks", m.asks); f("ahead", m.ahead);
  }
};

/// Master -> all viewers of a wall: present this frame at this time, then draw the next one as this says.
struct Swap {
  static constexpr std::string_view kName = "swap";
  InstanceId master;
  uint64_t frame = 0;        ///< presented now; the next one has the next number
  double at_s = 0;           ///< time to present it
  double t_s = 0;            ///< time of the next frame, as in SwapReady; likewise the next two:
  geometry::Pose head;
  ShownState state;
  uint64_t viewers = 0;      ///< viewers that had drawn this frame
  uint64_t skew_frame = 0;   ///< the newest frame that all viewers have reported as presented; 0: none yet
  double skew_s = 0;         ///< seconds between the first and the last to present it
  uint64_t ask = 0;          ///< rises by one when all are to request views of one head; 0: never yet
  geometry::Pose ask_head;   ///< pose of that head
  template <class F> static void fields(F& f, auto& m) {
    f("master", m.master); f("frame", m.frame); f("at_s", m.at_s); f("t_s", m.t_s); f("head", m.head);
    f("state", m.state); f("viewers", m.viewers); f("skew_frame", m.skew_frame); f("skew_s", m.skew_s);
    f("ask", m.ask); f("ask_head", m.ask_head);
  }
};

// clang-format on

}  // namespace telesplat::wire
