// The display in a window: the person moves the camera, or a recorded head does.
#pragma once

#include "client/displays/window/hands/hand_overlays.h"
#include "client/displays/window/hands/window_notes.h"
#include "client/displays/window/input/interaction.h"
#include "client/displays/window/legend.h"
#include "client/displays/window/measuring.h"
#include "client/displays/window/opening.h"
#include "client/displays/window/panel/gui/panel_gui.h"
#include "client/displays/window/panel/panel_orders.h"
#include "client/displays/window/screenshots.h"
#include "client/displays/window/title_line.h"
#include "client/displays/window/view_settings.h"
#include "client/displays/window/window_views.h"
#include "client/viewer/input/pose_feed.h"
#include "client/viewer/viewer_service.h"

namespace telesplat::viewer {

/// State of a window when a frame was presented.
struct PresentedWindow {
  double at_s = -1e9;
  int width = 0, height = 0;  ///< the window's size, pixels
  uint64_t overlays = 0;      ///< Overlays::version()
  bool gui = false;           ///< Dear ImGui draws something over the frame
  /// True if both show the same beside the frame.
  bool like(const PresentedWindow& o) const {
    return width == o.width && height == o.height && overlays == o.overlays && gui == o.gui;
  }
};

class WindowSurface final : public DisplaySurface {
 public:
  /// The options' movement plays, unless it stands still, until the person takes the camera.
  static Result<std::unique_ptr<WindowSurface>> open(const ViewerOptions& options, const DisplayHelp& help);
  /// Writes a path that is being recorded.
  ~WindowSurface() override;

  int width() const { return window_->width(); }
  int height() const { return window_->height(); }

  void on_scene(const ShownScene& scene) override;
  geometry::Camera begin_frame(double now_s, double t_s, Look& look) override;
  void on_session(const std::shared_ptr<const wire::Welcome>& session) override;
  std::optional<SamplingWish> take_sampling() override { return chosen_.take_sampling(); }
  geometry::Pose head() const override { return interaction_.pose(); }
  geometry::Camera camera_of(const geometry::Pose& head) const override { return views_.camera_of(head); }
  bool visible() const override { return true; }
  std::optional<PoseMoment> pose_moment() const override {
    return interaction_.tracked() ? poses_->moment() : std::nullopt;
  }
  double refresh_s() override { return window_->refresh_s(); }
  void present(const image::View& view, bool changed) override;
  void on_legend(const std::shared_ptr<const image::Legend>& legend) override { legend_.on_legend(legend); }
  bool wants_picture() const override { return interaction_.wants(Wish::kScreenshot); }
  void take_picture(const image::View& view, image::Alpha alpha) override;
  std::optional<PictureWish> take_picture_wish(geometry::Camera& camera) override;
  void take_wished_picture(const PictureWish& wish, image::View picture, image::Alpha alpha) override;
  void report(const FrameFigures& figures) override;
  std::optional<glm::dvec2> points_at() override { return measuring_.points_at(); }
  void on_pick(const std::optional<Pick>& pick, EpochId epoch) override {
    measuring_.on_pick(pick, epoch, hands_.terms());
  }
  Measurements* measurements() override { return &measuring_.places(); }
  void on_terms(const std::shared_ptr<const SceneTerms>& terms) override { hands_.on_terms(terms); }
  Status set(const std::string& name, const std::string& value) override;
  std::optional<StereoOptions> take_stereo() override { return chosen_.take_stereo(); }
  bool go_to(const geometry::Pose& pose) override {
    interaction_.go_to(pose);
    return true;
  }
  bool wants_to_stop() const override { return window_->closing() || interaction_.wants_to_quit(); }
  std::string failure() const override { return window_->lost() ? "the display went away" : ""; }

 private:
  struct Lines;  // lines for the person, from any thread
  WindowSurface(const ViewerOptions& options, const DisplayHelp& help, std::unique_ptr<Window> window);
  std::vector<std::string> key_lines() const;
  void keep_path();
  ViewSettings settings() const;
  void choose(double now_s, const std::string& name, const std::string& value);
  std::map<std::string, std::string> values() const;
  void tell(const std::string& line);
  void run_panel(double now_s, Look& look);
  double build_panel(double now_s);
  void save_transfer();
  std::string path_folder() const { return options_.record.out.empty() ? "." : options_.record.out; }
  // True if there is a data set, or if one will come.
  bool has_scene() const { return !options_.window.begins_empty || views_.has_scene(); }
  void follow_bookmarks();

  ViewerOptions options_;  // options_.display: with the person's changes
  ChosenSettings chosen_;
  std::unique_ptr<Window> window_;
  Interaction interaction_;
  std::shared_ptr<PoseFeed> poses_;  // moves the camera until the person takes it; null: there is no feed
  TitleLine title_;
  Overlays overlays_;
  HandOverlays hands_{text_panel};
  std::shared_ptr<Lines> lines_;
  WindowNotes notes_;
  Measuring measuring_{*window_, interaction_, hands_, overlays_, [this](const std::string& line) { tell(line); }};
  WindowLegend legend_{*window_, options_.display, overlays_};
  WindowViews views_{options_, *window_, legend_, interaction_};
  PresentedWindow shown_;
  Panel panel_;
  SceneControls scene_controls_{[this](Order order) { panel_.order(std::move(order)); }};
  PanelGui gui_{panel_, scene_controls_, overlays_};
  Opening opening_;
  PanelOrders orders_;
  Screenshots screenshots_;
};

}  // namespace telesplat::viewer
