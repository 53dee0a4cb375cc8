// When a new replica takes the place of the one on display: the old epoch stays until the new one covers the view or
// the patience is over, so that a changing scene neither flickers nor lags. Times come as arguments, decisions go out;
// no sockets, no clocks, no model.
#pragma once

#include <optional>

#include "common/core/ids.h"

namespace telesplat::viewer {

/// One replica is on display, at most one newer grows behind it. The newer one is shown
///   - as soon as a complete frame of full resolution is in it that this viewer asked for, or
///   - when `patience_s` have passed since the first epoch began that has not been shown, and there is something that
///     covers a view: a complete frame, also a coarse one or another viewer's; where frames have no coarse pass, any
///     part.
/// An epoch that is superseded before it was shown does not start the clock again: however fast epochs follow each
/// other, something newer is shown after the patience and the time to a coarse frame.
/// A replica of the displayed epoch (the packer was restarted, the scene is the same) has no hurry: it waits for a
/// complete frame of full resolution, whoever asked for it.
class EpochSwitch {
 public:
  explicit EpochSwitch(double patience_s) : patience_s_(patience_s) {}

  /// An empty replica begins. epoch 0: its first part will tell. held: an older one stays on display; else the new one
  /// is on display at once and there is nothing to decide. A newer one that was waiting is given up.
  void begin(EpochId epoch, bool held, double now_s);

  struct Part {
    EpochId epoch;
    uint64_t step = 1;            ///< wire::Patch::step
    bool frame_complete = false;  ///< the last part of its frame
    bool own = false;             ///< of a view that this viewer asked for
  };
  /// Part of a frame was applied to the newest replica.
  void on_part(const Part& part, double now_s);

  /// Whether the newest replica is to be shown now. Changes with time alone: ask again every few milliseconds.
  bool due(double now_s) const;
  /// It is.
  void shown();

  bool waiting() const { return waiting_; }
  EpochId displayed() const { return displayed_; }
  EpochId newest() const { return newest_; }
  /// When the first epoch began that has not been shown.
  std::optional<double> waiting_since_s() const { return since_s_; }

 private:
  void name(EpochId epoch, double now_s);

  double patience_s_;
  EpochId displayed_, newest_;
  bool waiting_ = false;
  std::optional<double> since_s_;
  // What the newest replica holds:
  bool any_ = false, coarse_seen_ = false, coarse_complete_ = false, complete_ = false, own_complete_ = false;
};

}  // namespace telesplat::viewer
