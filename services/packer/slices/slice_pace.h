// When the next frame may go to an asynchronous viewer, so that it does not wait behind another one on the link: from
// how long the frames before it took to be acknowledged. No sockets, no clocks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

#include "common/core/ids.h"

namespace telesplat::packer {

class SlicePace {
 public:
  /// A link that needs less for what is under way holds up nobody: the next frame goes at once.
  static constexpr double kShort_s = 0.05;
  /// Of the time that the frames under way should need, what passes before the next one follows. Less than all of it,
  /// so that the link is never idle, and that a rate that was taken for too low is found to be higher.
  static constexpr double kShare = 0.8;
  static constexpr double kWindow_s = 5;  ///< for the highest rate, and the window before
  /// Two acknowledgements that are nearer than this were read together.
  static constexpr double kLeast_s = 0.002;

  /// Bytes a second that are wished at most; 0: no wish.
  void set_most(double bytes_s) { wished_ = bytes_s; }

  /// Times never fall.
  void sent(FrameId frame, uint64_t bytes, double now_s);
  /// Frames that were not sent change nothing.
  void acknowledged(FrameId frame, double now_s);
  /// What is under way is lost, or seems to be: it is sent again. The rate stays known; what is sent twice tells
  /// nothing of it, for the first copy may be acknowledged.
  void lost() { under_way_.clear(); }

  /// The next frame may go out then; in the past: at once.
  double next_s() const { return std::max(link_free_s(), wish_s_); }
  /// As far as the wished rate goes.
  double wished_s() const { return wish_s_; }
  /// What the link carried at most, in the last 5 to 10 s; 0: not known.
  double rate_bytes_s() const { return std::max(most_, before_); }

 private:
  struct Sent {
    FrameId frame;
    uint64_t bytes;
    double sent_s;
    bool again;
  };
  double link_free_s() const;

  std::deque<Sent> under_way_;                   // oldest first
  FrameId newest_;                               // that was sent
  double last_s_ = 0;                            // acknowledgement
  double most_ = 0, before_ = 0, window_s_ = 0;  // bytes a second; in this window and the one before; its begin
  double wished_ = 0, wish_s_ = 0;               // a link of the wished rate would be done by then
};

}  // namespace telesplat::packer
