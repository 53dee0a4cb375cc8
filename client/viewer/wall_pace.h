// A display that is one of a wall's: it presents its frames when the others do, and draws what they draw, seen by the
// same head. The master says when and what (wire::Swap). Used by one thread, the display's.
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
  /// Until frames are presented without a word from the master: before the first one, and later.
  static constexpr double kFirstPatience_s = 8, kPatience_s = 0.6;

  struct Options {
    std::string master, name;          ///< the master's address; the viewer's name, for logs
    std::string wall;                  ///< what all viewers of the wall call it
    uint64_t number = 0, viewers = 1;  ///< this one's among them
    double period_s = 0;               ///< between two frames at least
    double asks_hz = 20;               ///< how often all ask for views of one head, at most
  };
  /// A frame as it is to be drawn.
  struct Turn {
    uint64_t frame = 0;  ///< of the wall
    double t_s = 0;      ///< on the clock of the head's movement
    geometry::Pose head;
    wire::ShownState state;
  };
  /// What this display would draw next by itself.
  struct Wish {
    double t_s = 0;
    geometry::Pose head;
    wire::ShownState state;
    double horizon_s = 0;  ///< views are asked for of where the head is so much later; 0: none are, of one head
  };
  struct Swapped {
    double wait_s = 0;        ///< from drawn() until it is to be presented
    bool alone = false;       ///< no word came in time
    uint64_t skew_frame = 0;  ///< wire::Swap
    double skew_s = 0;
    uint64_t ask = 0;  ///< of which head to ask for a view now, and its number; 0: of none
    geometry::Pose ask_head;
  };

  /// Connects. viewer: as the viewer says hello. to_master_s: this machine's monotonic time on the master's clock.
  WallPace(net::Context& context, const Options& options, std::function<InstanceId()> viewer,
           std::function<double(double)> to_master_s);

  /// The frame at hand is drawn (frame 0: there is none yet). Returns when it is to be presented; turn() is the next
  /// one then. stopped: asked ten times a second; true: it returns at once.
  Swapped drawn(const Wish& next, const std::function<bool()>& stopped);
  /// It has been presented.
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
  InstanceId led_by_;  // whose number its frame has
  bool begun_ = false, alone_ = false;
  uint64_t drawn_ = 0, presented_ = 0;
  double presented_s_ = 0;  // master's clock
  double late_s_ = 0;
  tracking::PosePredictor predictor_;  // of the head as this display sees it
  InstanceId asked_by_;                // who said last what to ask for
  uint64_t asked_ = 0;                 // its number
  double ask_due_s_ = -1e9;            // the next one
};

}  // namespace telesplat::viewer
