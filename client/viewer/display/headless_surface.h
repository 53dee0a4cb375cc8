// No window: the head follows a trajectory, frames are measured and recorded only.
#pragma once

#include <algorithm>
#include <utility>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/input/head_movement.h"

namespace telesplat::viewer {

class HeadlessSurface final : public DisplaySurface {
 public:
  HeadlessSurface(const DisplayOptions& options, HeadMovement movement)
      : options_(options), movement_(std::move(movement)) {
    if (movement_.recorded) trajectory_ = *movement_.recorded;
  }

  /// A head that moves already stays on its way.
  void on_scene(const ShownScene& scene) override {
    if (!moves_) trajectory_ = movement_.trajectory(scene.box_room, fitting_camera(options_));
  }
  geometry::Camera begin_frame(double, double t_s, Look&) override {
    const auto& o = options_;
    moves_ = moves_ || t_s >= 0;
    const double now_s = std::max(0.0, t_s);
    const double moving_s = o.duration_s > 0 ? std::min(now_s, o.duration_s - o.hold_s) : now_s;
    head_ = trajectory_.at(moving_s);
    return camera_of(head_);
  }
  geometry::Pose head() const override { return head_; }
  geometry::Camera camera_of(const geometry::Pose& head) const override { return display_camera(options_, head); }
  bool visible() const override { return false; }
  void present(const image::View&, bool) override {}
  void report(const LiveFigures&) override {}
  bool wants_to_stop() const override { return false; }

 private:
  DisplayOptions options_;
  HeadMovement movement_;
  geometry::Trajectory trajectory_ = geometry::Trajectory::still({});
  geometry::Pose head_;
  bool moves_ = false;
};

}  // namespace telesplat::viewer
