// The display in a window: the person moves the camera, or a recorded head does.
#pragma once

#include <functional>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/display/title_line.h"
#include "client/viewer/display/window.h"
#include "client/viewer/record/screenshots.h"

namespace telesplat::viewer {

class WindowSurface final : public DisplaySurface {
 public:
  struct Options {
    DisplayOptions display;
    std::optional<geometry::Trajectory> recorded;  ///< a head movement that plays until the person takes the camera
    bool fullscreen = false;
    std::string screenshot_directory = ".";
  };
  /// tell: lines for the person; may be called from another thread, never from two at once.
  static Result<std::unique_ptr<WindowSurface>> open(const Options& options,
                                                     std::function<void(const std::string&)> tell);

  int width() const { return window_->width(); }
  int height() const { return window_->height(); }

  geometry::Camera begin_frame(double now_s, double t_s, Look& look) override;
  bool visible() const override { return true; }
  void present(const image::View& view) override;
  void report(const LiveFigures& figures) override;
  Overlays* overlays() override { return &overlays_; }
  bool wants_to_stop() const override { return window_->closing() || interaction_.wants_to_quit(); }

 private:
  WindowSurface(const Options& options, std::unique_ptr<Window> window, std::function<void(const std::string&)> tell);

  DisplayOptions options_;
  std::unique_ptr<Window> window_;
  Interaction interaction_;
  TitleLine title_;
  Overlays overlays_;
  std::function<void(const std::string&)> tell_;
  Screenshots screenshots_;
};

/// A camera whose field of view `fov_deg` spans the longer side of the image: a window that is made narrow does not
/// become a tunnel.
geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m);

}  // namespace telesplat::viewer
