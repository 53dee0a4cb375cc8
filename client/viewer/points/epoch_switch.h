// Decides when a new replica replaces the one on display: the old epoch stays until the new one covers the view or the
// patience is over, so that a changing scene neither flickers nor lags. Times come as arguments, decisions go out; no
// sockets, no clocks, no model.
#pragma once

#include <optional>

#include "common/core/ids.h"

namespace telesplat::viewer {

/// One replica is on display; at most one newer replica grows behind it. The newer one is shown
///   - as soon as it has a complete frame of full resolution that this viewer asked for, or
///   - when `patience_s` have passed since the first epoch began that has not been shown, and it has something that
///     covers a view: a complete frame, also a coarse one or another viewer's; if frames have no coarse pass, any part.
/// An epoch that is superseded before it was shown does not start the clock again: even if epochs follow each other
/// fast, something newer is shown after the patience and the time to a coarse frame.
/// A replica of the displayed epoch (the packer was restarted, the scene is the same) has no hurry: it waits for a
/// complete frame of full resolution, of any viewer.
class EpochSwitch {
 public:
  explicit EpochSwitch(double patience_s) : patience_s_(patience_s) {}

  /// An empty replica begins. epoch: 0 if its first part is to name it. held: an older one stays on display; else the
  /// new one is on display at once and there is nothing to decide. A newer one that was waiting is dropped.
  void begin(EpochId epoch, bool held, double now_s);

  struct Part {
    EpochId epoch;
    uint64_t step = 1;            ///< wire::Patch::step
    bool frame_complete = false;  ///< the last part of its frame
    bool own = false;             ///< from a view that this viewer asked for
  };
  /// A part of a frame was applied to the newest replica.
  void on_part(const Part& part, double now_s);

  /// True if the newest replica is to be shown now. This changes with time alone: ask again every few milliseconds.
  bool due(double now_s) const;
  /// The newest replica is on display.
  void shown();

  bool waiting() const { return waiting_; }
  EpochId displayed() const { return displayed_; }
  EpochId newest() const { return newest_; }
  /// When the first epoch began that has not been shown; nothing: there is no such epoch.
  std::optional<double> waiting_since_s() const { return since_s_; }

 private:
  void name(EpochId epoch, double now_s);

  double patience_s_;
  EpochId displayed_, newest_;
  bool waiting_ = false;
  std::optional<double> since_s_;
  // Content of the newest replica:
  bool any_ = false, coarse_seen_ = false, coarse_complete_ = false, complete_ = false, own_complete_ = false;
};

}  // namespace telesplat::viewer
