// The display in a headset: every refresh shows the cached scene to both eyes, from where the runtime predicts them,
// even if the server is late.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/displays/xr/headset_session.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/viewer_service.h"

namespace telesplat::viewer {

/// Draws the rays of hands to what they point at, and tells the place when a trigger is pressed.
class HandPointers {
 public:
  using Tell = std::function<void(const std::string&)>;
  /// Finds the rays' ends in the picture of this camera.
  void point(const HandRays& rays, const image::View& view, const geometry::Camera& camera, const Tell& tell);
  void draw(const HandRays& rays, image::View& view, const geometry::Camera& camera) const;

 private:
  std::array<glm::dvec3, 2> ends_{};
  std::array<bool, 2> pressed_{};
};

/// Chooses the pictures that are drawn each second, so that both eyes' fit into a refresh.
class EyePace {
 public:
  /// pair: one choice of points serves both eyes' pictures. period_s: a refresh.
  void follow(bool pair, double period_s);
  double pictures_a_second() const { return pictures_a_second_; }

 private:
  double pictures_a_second_ = 0;
  bool as_pair_ = true;  // so far one choice of points served both eyes
};

/// The runtime's clock paces frames. A lost session is opened anew every second. Recorded pictures are the left eye's.
class XrSurface final : public DisplaySurface {
 public:
  using Tell = HandPointers::Tell;

  /// tell: prints lines for the person. Error: the part of runtime, headset or OpenGL that is missing.
  static Result<std::unique_ptr<XrSurface>> open(const XrOptions& options, double near_m, Tell tell);
  /// Reports to the runtime that the application ends: states follow, for which there is little time.
  ~XrSurface() override;

  /// Pixels of an eye's picture that the runtime recommends.
  const XrSystem::EyeSize& eye_size() const { return system_->eye_size(); }

  bool ready() override;
  bool paces() const override { return true; }
  const std::array<geometry::Camera, 2>* eyes() const override { return located_ ? &located_->cameras : nullptr; }
  double pictures_a_second() const override { return pace_.pictures_a_second(); }
  double seen_s(double) const override { return frame_.display_s; }
  bool take_jump() override { return std::exchange(jumped_, false); }
  std::optional<ExpectedHead> expected(double at_s) override;
  void on_scene(const ShownScene&) override {}
  geometry::Camera begin_frame(double, double, Look&) override { return camera_; }
  geometry::Pose head() const override { return head_; }
  std::optional<PoseMoment> pose_moment() const override {
    return PoseMoment{located_s_, frame_.display_s - located_s_};
  }
  geometry::Camera camera_of(const geometry::Pose&) const override { return camera_; }
  bool visible() const override { return true; }
  void present(const image::View&, bool) override {}
  void present_eyes(std::array<image::View, 2>& views) override;
  void measure(Seen& seen, double presented_s) override;
  void report(const FrameFigures&) override {}
  Status set(const std::string&, const std::string&) override {
    return Error{"a headset's display keeps what it began with"};
  }
  bool wants_to_stop() const override { return quits_; }

 private:
  XrSurface(const XrOptions& options, double near_m, Tell tell)
      : options_(options), near_m_(near_m), tell_(std::move(tell)) {}
  Status open_system();
  void open_session();
  bool follow_session();
  bool begin();

  const XrOptions options_;
  const double near_m_;
  const Tell tell_;
  std::unique_ptr<gl::EglContext> context_;  // for the pictures' textures
  std::unique_ptr<XrSystem> system_;
  std::unique_ptr<HeadsetSession> session_;
  bool lost_ = false, quits_ = false, jumped_ = false;
  double open_at_s_ = 0;
  std::string trouble_;  // the last one that was reported
  // Values of the frame at hand.
  HeadsetSession::Frame frame_;
  std::optional<HeadsetSession::Eyes> located_;
  geometry::Camera camera_;  // covers the views of both eyes
  geometry::Pose head_;
  double located_s_ = 0, last_display_s_ = 0;
  int missed_ = 0;
  EyePace pace_;
  HandPointers pointers_;
};

/// Displays::headset.
Result<std::unique_ptr<DisplaySurface>> open_headset(ViewerOptions& options, const DisplayHelp& help);

}  // namespace telesplat::viewer
