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
    if (!moves_) trajectory_ = movement_.trajectory(scene.box_room, whole({}));
  }
  geometry::Camera begin_frame(double, double t_s, Look&) override {
    const auto& o = options_;
    moves_ = moves_ || t_s >= 0;
    const double now_s = std::max(0.0, t_s);
    const double moving_s = o.duration_s > 0 ? std::min(now_s, o.duration_s - o.hold_s) : now_s;
    return tile_of(whole(trajectory_.at(moving_s)), o.wall);
  }
  bool visible() const override { return false; }
  void present(const image::View&, bool) override {}
  void report(const LiveFigures&) override {}
  bool wants_to_stop() const override { return false; }

 private:
  // Of all tiles of a wall.
  geometry::Camera whole(const geometry::Pose& pose) const {
    const auto& o = options_;
    return geometry::make_camera(pose, o.fov_deg, o.width * o.wall.columns, o.height * o.wall.rows, o.near_m);
  }

  DisplayOptions options_;
  HeadMovement movement_;
  geometry::Trajectory trajectory_ = geometry::Trajectory::still({});
  bool moves_ = false;
};

}  // namespace telesplat::viewer
