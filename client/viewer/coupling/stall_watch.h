// Where the display waits for view updates: what it does and says when none comes for long (docs/coupling.md). Times
// come in.
#pragma once

#include <optional>
#include <string>

#include "client/viewer/coupling/coupling.h"

namespace telesplat::viewer {

class StallWatch {
 public:
  static constexpr double kLong_s = 1;   ///< a wait that is told to people
  static constexpr double kMost_s = 10;  ///< without any sign of an answer; then frames are drawn from what is there

  explicit StallWatch(double most_s = kMost_s) : most_s_(most_s) {}

  /// No update has come by now_s, in a wait that began at begin_s. last_sign_s: when part of an answer last came. True:
  /// a frame is to be drawn from what is there, and so is every further one until an update comes.
  bool waiting(double now_s, double begin_s, double last_sign_s, const CouplingState& coupling);
  /// An update came, or nothing is waited for any more.
  void over(double now_s);

  /// How long it has waited; 0: not for long enough to tell people.
  double told_s(double now_s) const { return told_ ? now_s - *since_s_ : 0; }
  /// What is to be logged, once: when a wait begins to be long, when frames are drawn from what is there, when it is
  /// over.
  std::optional<std::string> take_news();

 private:
  double most_s_;
  std::optional<double> since_s_;  // the wait began
  bool told_ = false, draws_ = false;
  std::optional<std::string> news_;
};

}  // namespace telesplat::viewer
