// Keeps one display of a wall in step: it presents its frames together with the others, and draws the same state, seen
// by the same head. The master sends when and what (wire::Swap). Used by one thread, the display's.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "client/viewer/tracking/pose_predictor.h"
#include "common/net/socket.h"
#include "common/wire/wall_messages.h"

namespace telesplat::viewer {

class WallPace {
 public:
  /// Seconds to wait for a word from the master before frames are presented without it: for the first frame, and later.
  static constexpr double kFirstPatience_s = 8, kPatience_s = 0.6;

  struct Options {
    std::string master, name;          ///< the master's address; this viewer's name, for logs
    std::string wall;                  ///< name of the wall, equal in all its viewers
    uint64_t number = 0, viewers = 1;  ///< this viewer's number in the wall; their count
    double period_s = 0;               ///< least time between two frames
    double asks_hz = 20;               ///< requests a second, at most, that all make for views of one head
  };
  /// A frame that is to be drawn.
  struct Turn {
    uint64_t frame = 0;  ///< the frame's number in the wall
    double t_s = 0;      ///< on the clock of the head's movement
    geometry::Pose head;
    wire::ShownState state;
  };
  /// State that this display would draw next by itself.
  struct Wish {
    double t_s = 0;
    geometry::Pose head;
    wire::ShownState state;
    double horizon_s = 0;  ///< all ask for views of one head, predicted this far ahead; 0: not of one head
  };
  struct Swapped {
    double wait_s = 0;        ///< from the call of drawn() to the moment to present
    bool alone = false;       ///< no word of the master came in time
    uint64_t skew_frame = 0;  ///< wire::Swap
    double skew_s = 0;
    uint64_t ask = 0;  ///< number of the request to send now, for ask_head; 0: no request
    geometry::Pose ask_head;
  };

  /// Connects. viewer: its instance. to_master_s: converts this machine's monotonic time to the master's clock.
  WallPace(net::Context& context, const Options& options, std::function<InstanceId()> viewer,
           std::function<double(double)> to_master_s);

  /// The frame at hand is drawn (frame 0: there is no frame yet). Waits, and returns when it is to be presented; turn()
  /// is then the next frame. stopped: asked ten times a second; if true, drawn() returns at once.
  Swapped drawn(const Wish& next, const std::function<bool()>& stopped);
  /// The frame has been presented.
  void presented(double now_s);
  const Turn& turn() const { return turn_; }

 private:
  bool asks(double now_s, const Wish& next) const;
  void take_ask(const wire::Swap& swap, Swapped& out);
  std::optional<wire::Swap> take(bool waited);
  std::optional<wire::Swap> wait(const wire::SwapReady& ready, double patience_s, const std::function<bool()>& stopped);

  Options options_;
  std::function<InstanceId()> viewer_;
  std::function<double(double)> to_master_s_;
  net::Socket socket_;
  Turn turn_;
  InstanceId led_by_;  // the master that numbered turn_.frame
  bool begun_ = false, alone_ = false;
  uint64_t drawn_ = 0, presented_ = 0;
  double presented_s_ = 0;  // master's clock
  double late_s_ = 0;
  tracking::PosePredictor predictor_;  // predicts the head as this display sees it
  InstanceId asked_by_;                // the master that sent the last request number
  uint64_t asked_ = 0;                 // that number
  double ask_due_s_ = -1e9;            // when the next request is due
};

}  // namespace telesplat::viewer
