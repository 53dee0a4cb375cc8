// Computes SelectionOptions::detail: the detail that fits into the frame time, and that a moving head can see
// (T4.4.3.1). Times and poses go in, detail comes out. There are no clocks inside, so any machine can be simulated.
#pragma once

#include "common/geometry/camera.h"

namespace telesplat::viewer {

inline constexpr double kLeastDetail = 0.3;

/// A controller that keeps the time to construct a view (select, splat, finish) within a budget. Between 82 and 100
/// % of it nothing changes, so noise does not make the picture pulse; above, detail falls; below, it rises to 1 again.
class FrameBudget {
 public:
  /// budget_ms <= 0: no limit, detail stays 1. Detail falls no lower than `least`.
  explicit FrameBudget(double budget_ms, double least = kLeastDetail) : budget_ms_(budget_ms), least_(least) {}

  /// To be called after each frame.
  ///   select_ms: time to choose what to draw, which does not depend on detail. draw_ms: time to draw it.
  ///   points: the number drawn. detail_drawn: their detail. If it was less than this controller allowed, a fast frame
  ///   is no reason to allow more.
  /// Drawing may take the part of the budget that choosing leaves, but at least 40 % of it: if choosing alone takes too
  /// long, a coarser picture would not help. Figures that are not finite and frames without points are ignored.
  void frame_done(double select_ms, double draw_ms, double points, double detail_drawn);

  /// Detail for the next frame, in [least, 1]. Changes by at most 2 % a frame, 6 % while frames take more than twice
  /// the budget.
  double detail() const { return detail_; }
  double budget_ms() const { return budget_ms_; }

 private:
  double budget_ms_, least_;
  double detail_ = 1;
  double last_[2] = {0, 0};  // time to draw over the time there is for it, for the two frames before
  double load_ = 0;          // smoothed
};

/// Decides if frames are drawn at half their size (RenderOptions::halved): if the least detail still takes longer than
/// the budget. Splats are some pixels wide then, so pixels cost more than they show, and take time from the samplers of
/// a small machine.
class HalfSize {
 public:
  /// budget_ms <= 0: never.
  explicit HalfSize(double budget_ms) : budget_ms_(budget_ms) {}

  /// To be called after each frame that was drawn as on() said. draw_ms: time to draw it. least: FrameBudget is at its
  /// least detail. Halving begins after 20 frames with a load above 115 % of the budget. It ends after 60 frames or
  /// later, once frames of full size would take less than 70 %, judged by the saving when it began. Figures that are
  /// not finite are ignored.
  void frame_done(double draw_ms, bool least);
  bool on() const { return on_; }

 private:
  double budget_ms_;
  bool on_ = false;
  int frames_ = 0;           // since `on_` changed
  double last_[2] = {0, 0};  // times to draw over the budget, for the two frames before
  double load_ = 0;          // smoothed, since `on_` changed
  double load_before_ = 0;   // load_ when `on_` changed
  double saved_ = 1;         // a frame of full size takes this many times as long
};

/// The thesis divides the desired pixel range by the head's velocity. We divide it by the speed of typical content on
/// the screen, in units of kFreePixels each 60th of a second; slower movements cost nothing. Detail follows within
/// about 0.3 s.
class SpeedDetail {
 public:
  static constexpr double kFreePixels = 12;

  /// Call it before each frame. depth_m: distance of typical content. The first frame, and times that do not advance,
  /// count as no movement.
  void frame(double now_s, const geometry::Camera& camera, double depth_m);
  double detail() const { return detail_; }

 private:
  bool has_last_ = false;
  double last_s_ = 0, detail_ = 1;
  geometry::Pose last_;
};

/// Upper bound, over all directions of view, on how far content `depth_m` away moves on the screen between two poses,
/// in pixels.
double screen_movement(const geometry::Pose& from, const geometry::Pose& to, double depth_m, double focal_px);

}  // namespace telesplat::viewer
