// The display in a window: the person moves the camera, or a recorded head does.
#pragma once

#include <functional>

#include "client/viewer/display/display_options.h"
#include "client/viewer/display/display_surface.h"
#include "client/viewer/display/title_line.h"
#include "client/viewer/display/window.h"
#include "client/viewer/input/head_movement.h"
#include "client/viewer/record/screenshots.h"

namespace telesplat::viewer {

class WindowSurface final : public DisplaySurface {
 public:
  struct Options {
    DisplayOptions display;
    HeadMovement movement;  ///< unless it stands still it plays until the person takes the camera
    bool fullscreen = false;
    std::string screenshot_directory = ".", path_directory = ".";
  };
  /// tell: lines for the person; may be called from another thread, never from two at once.
  static Result<std::unique_ptr<WindowSurface>> open(const Options& options,
                                                     std::function<void(const std::string&)> tell);
  /// A path that is being recorded is written.
  ~WindowSurface() override;

  int width() const { return window_->width(); }
  int height() const { return window_->height(); }

  void on_scene(const ShownScene& scene) override;
  geometry::Camera begin_frame(double now_s, double t_s, Look& look) override;
  bool visible() const override { return true; }
  void present(const image::View& view, bool changed) override;
  void on_legend(const std::shared_ptr<const image::Legend>& legend) override;
  bool wants_picture() const override { return interaction_.wants_screenshot(); }
  void take_picture(const image::View& view, image::Alpha alpha) override;
  void report(const LiveFigures& figures) override;
  Overlays* overlays() override { return &overlays_; }
  bool wants_to_stop() const override { return window_->closing() || interaction_.wants_to_quit(); }
  std::string failure() const override { return window_->lost() ? "the display went away" : ""; }

 private:
  WindowSurface(const Options& options, std::unique_ptr<Window> window, std::function<void(const std::string&)> tell);
  geometry::Camera whole(const geometry::Pose& pose) const;
  void fit_views();
  void show_help();
  void show_legend();
  void keep_path();

  Options options_;
  std::unique_ptr<Window> window_;
  Interaction interaction_;
  TitleLine title_;
  std::string title_text_, title_shown_;
  Overlays overlays_;
  ShownScene scene_;
  int fitted_width_ = 0, fitted_height_ = 0;  // of the window that the first view suits; 0: none yet
  std::shared_ptr<const image::Legend> legend_;
  int legend_width_ = 0, legend_height_ = 0;  // of the window that the legend on display suits
  struct Shown {
    double at_s = -1e9;
    int width = 0, height = 0;  // of the window
    uint64_t overlays = 0;      // their version
  };
  Shown shown_;         // what is in the window
  int help_scale_ = 0;  // of the overlay's letters; 0: it is not shown
  std::function<void(const std::string&)> tell_;
  Screenshots screenshots_;
};

/// A camera whose field of view `fov_deg` spans the longer side of the image: a window that is made narrow does not
/// become a tunnel.
geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m);

}  // namespace telesplat::viewer
