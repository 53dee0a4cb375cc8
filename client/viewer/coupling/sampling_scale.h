// Adapts the sampling of views to the time that updates take, and to scenes that change.
#pragma once

#include "common/geometry/camera.h"

namespace telesplat::viewer {

/// Sampled pixels a displayed pixel, on each axis: `least` to 1. The caller gives the times.
class SamplingScale {
 public:
  /// Begins anew with the next view.
  void reset() { scale_ = 0; }
  double of(const geometry::Camera& display, double least);
  /// A view took own_s; target_s: the time it should take.
  void follow(double own_s, double target_s, double least);
  /// Does the same for steered views. whole: samplers cast a ray for more than 1 of 4 pixels.
  void follow_steered(double own_s, double target_s, bool whole, double least);

 private:
  double scale_ = 0;         // 0: not begun
  int slow_ = 0, fast_ = 0;  // updates in a row that took too long; that left time
};

/// Tells if the scene changes, so that a view may soon be out of date. The caller gives the times.
class SceneChange {
 public:
  void on_epoch(double now_s) { epoch_s_ = now_s; }
  void on_update(double now_s) { update_s_ = now_s; }
  /// Decides for the request that is made at now_s.
  void look(double now_s) { changing_ = update_s_ < epoch_s_ || now_s - epoch_s_ < kSettles_s; }
  /// As look() found it.
  bool changing() const { return changing_; }
  /// Start of the newest epoch.
  double epoch_s() const { return epoch_s_; }

 private:
  static constexpr double kSettles_s = 1.0;  // without a new epoch the scene counts as unchanging again
  double epoch_s_ = -1e9, update_s_ = -1e9;
  bool changing_ = false;
};

}  // namespace telesplat::viewer
