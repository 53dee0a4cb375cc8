// A display without a window: the head follows a trajectory or a publisher of poses; frames are measured and recorded.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/display/frame_figures.h"
#include "client/viewer/input/head_movement.h"
#include "client/viewer/input/pose_feed.h"
#include "common/core/clock.h"

namespace telesplat::viewer {

class HeadlessSurface final : public DisplaySurface {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// tell: prints lines for the person.
  HeadlessSurface(const DisplayOptions& options, HeadMovement movement, Tell tell = {})
      : options_(options), movement_(std::move(movement)), tell_(std::move(tell)) {
    if (movement_.recorded) trajectory_ = *movement_.recorded;
  }

  /// Poses of this feed move the head as soon as they come.
  void follow(std::shared_ptr<PoseFeed> poses) { poses_ = std::move(poses); }

  /// A head that moves already stays on its trajectory.
  void on_scene(const ShownScene& scene) override {
    if (!moves_) trajectory_ = movement_.trajectory(scene.box_room, fitting_camera(options_));
    if (told_ || !tell_) return;
    told_ = true;
    if (const auto news = cut_off_by_wall(options_, trajectory_.at(0), scene.box_room)) tell_(*news);
  }
  geometry::Camera begin_frame(double now_s, double t_s, Look&) override {
    if (poses_)
      if (const auto told = poses_->begin_frame(now_s)) return camera_of(head_ = *told);
    moves_ = moves_ || t_s >= 0;
    head_ = trajectory_.at(options_.span.moved_s(t_s));
    return camera_of(head_);
  }
  geometry::Pose head() const override { return head_; }
  std::optional<PoseMoment> pose_moment() const override { return poses_ ? poses_->moment() : std::nullopt; }
  geometry::Camera camera_of(const geometry::Pose& head) const override { return display_camera(options_, head); }
  bool visible() const override { return false; }
  void present(const image::View&, bool) override {
    if (poses_) poses_->presented(monotonic_s());
  }
  void report(const FrameFigures& figures) override {
    if (!poses_) return;
    if (const auto news = poses_->take_news(figures.now_s)) tell_(*news);
  }
  bool wants_to_stop() const override { return false; }

 private:
  DisplayOptions options_;
  HeadMovement movement_;
  std::shared_ptr<PoseFeed> poses_;
  Tell tell_;
  geometry::Trajectory trajectory_ = geometry::Trajectory::still({});
  geometry::Pose head_;
  bool moves_ = false, told_ = false;
};

}  // namespace telesplat::viewer
