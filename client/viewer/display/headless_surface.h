// No window: the head follows a trajectory, frames are measured and recorded only.
#pragma once

#include <algorithm>
#include <utility>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/display_surface.h"

namespace telesplat::viewer {

class HeadlessSurface final : public DisplaySurface {
 public:
  HeadlessSurface(const DisplayOptions& options, geometry::Trajectory trajectory)
      : options_(options), trajectory_(std::move(trajectory)) {}

  geometry::Camera begin_frame(double, double t_s, Look&) override {
    const auto& o = options_;
    const double now_s = std::max(0.0, t_s);
    const double moving_s = o.duration_s > 0 ? std::min(now_s, o.duration_s - o.hold_s) : now_s;
    return tile_of(geometry::make_camera(trajectory_.at(moving_s), o.fov_deg, o.width * o.wall.columns,
                                         o.height * o.wall.rows, o.near_m),
                   o.wall);
  }
  bool visible() const override { return false; }
  void present(const image::View&) override {}
  void report(const LiveFigures&) override {}
  bool wants_to_stop() const override { return false; }

 private:
  DisplayOptions options_;
  geometry::Trajectory trajectory_;
};

}  // namespace telesplat::viewer
