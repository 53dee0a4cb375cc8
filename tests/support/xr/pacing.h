// Refresh times of a display that does not exist.
#pragma once

namespace telesplat::xr_test {

/// Reads no clock: takes times.
class Pacing {
 public:
  /// Refreshes at origin_s and every 1 / rate_hz before and after.
  Pacing(double rate_hz, double origin_s) : period_s_(1 / rate_hz), origin_s_(origin_s), last_s_(origin_s) {}

  struct Frame {
    double display_s;  ///< the refresh that shows it
    double wake_s;     ///< its application begins: a period before, or now if that time is past
  };
  /// Returns the next frame of an application that asks at now_s: for a later refresh than the frame before, at least
  /// half a period from now.
  Frame next(double now_s);
  /// Returns the first refresh that can show a frame for display_s submitted at submitted_s: that one, or the next one
  /// after the submission.
  double shown_s(double display_s, double submitted_s) const;
  double period_s() const { return period_s_; }

 private:
  double refresh_from(double t_s) const;
  double period_s_, origin_s_, last_s_;
};

}  // namespace telesplat::xr_test
