// The display in a window: the person moves the camera, or a recorded head does.
#pragma once

#include <array>
#include <functional>

#include "client/displays/window/hands/bookmarks.h"
#include "client/displays/window/hands/hand_overlays.h"
#include "client/displays/window/legend.h"
#include "client/displays/window/measuring.h"
#include "client/displays/window/opening.h"
#include "client/displays/window/panel/control_desk.h"
#include "client/displays/window/panel/gui/notes_view.h"
#include "client/displays/window/panel/gui/panel_view.h"
#include "client/displays/window/panel/gui/scene_view.h"
#include "client/displays/window/panel/order_undo.h"
#include "client/displays/window/panel/panel.h"
#include "client/displays/window/panel/scene_controls.h"
#include "client/displays/window/panel/widget_log.h"
#include "client/displays/window/screenshots.h"
#include "client/displays/window/title_line.h"
#include "client/displays/window/view_settings.h"
#include "client/displays/window/window.h"
#include "client/viewer/input/pose_feed.h"
#include "client/viewer/viewer_service.h"

namespace telesplat::viewer {

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
  std::optional<SamplingWish> take_sampling() override { return std::exchange(sampling_wish_, std::nullopt); }
  geometry::Pose head() const override { return head_; }
  geometry::Camera camera_of(const geometry::Pose& head) const override;
  bool visible() const override { return true; }
  std::optional<PoseMoment> pose_moment() const override { return tracked_ ? poses_->moment() : std::nullopt; }
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
    measuring_.on_pick(pick, epoch, terms_.get());
  }
  Measurements* measurements() override { return &measuring_.places(); }
  void on_terms(const std::shared_ptr<const SceneTerms>& terms) override {
    terms_ = terms;
    hands_.on_terms(terms);
  }
  Status set(const std::string& name, const std::string& value) override;
  std::optional<StereoOptions> take_stereo() override { return std::exchange(stereo_wish_, std::nullopt); }
  bool go_to(const geometry::Pose& pose) override {
    interaction_.go_to(pose);
    return true;
  }
  bool wants_to_stop() const override { return window_->closing() || interaction_.wants_to_quit(); }
  std::string failure() const override { return window_->lost() ? "the display went away" : ""; }

 private:
  struct Lines;  // lines for the person, from any thread
  WindowSurface(const ViewerOptions& options, const DisplayHelp& help, std::unique_ptr<Window> window);
  geometry::Camera whole(const geometry::Pose& pose) const;
  // Frustum of the window's free part; its middle lies at a tangent from the view's axis.
  struct FreePart {
    geometry::Camera frustum;
    double middle_x;
  };
  FreePart free_part() const;
  void fit_views();
  void look_from(const Side& side);
  void show_help();
  std::vector<std::string> key_lines() const;
  void show_news(double now_s);
  void keep_path();
  ViewSettings settings() const;
  void choose(double now_s, const std::string& name, const std::string& value);
  std::map<std::string, std::string> values() const;
  void tell(const std::string& line);
  void run_panel(double now_s, Look& look);
  double build_panel(double now_s);
  void save_transfer();
  void give(Order order, bool undoes);
  std::string path_folder() const { return options_.record.out.empty() ? "." : options_.record.out; }
  // True if there is a data set, or if one will come.
  bool has_scene() const { return !options_.window.begins_empty || !scene_.box_room.empty(); }
  void follow_bookmarks(const geometry::Pose& pose);
  void follow_notes();
  notes::Shelf shelf() const;  // precondition: terms_

  ViewerOptions options_;            // options_.display: with the person's changes
  std::shared_ptr<PoseFeed> poses_;  // moves the camera until the person takes it; null: there is no feed
  SamplingWish sampling_;            // the person's choice
  bool sampling_chosen_;             // the person chose its least sampling
  std::optional<SamplingWish> sampling_wish_;
  std::optional<StereoOptions> stereo_wish_;
  std::unique_ptr<Window> window_;
  Interaction interaction_;
  TitleLine title_;
  std::string title_text_, title_shown_;
  Overlays overlays_;
  HandOverlays hands_{text_panel};
  std::shared_ptr<const SceneTerms> terms_;
  std::shared_ptr<Lines> lines_;
  Bookmarks bookmarks_;
  Measuring measuring_{*window_, interaction_, hands_, overlays_, [this](const std::string& line) { tell(line); }};
  ShownScene scene_;
  std::string scene_name_;
  bool had_scene_ = false;
  geometry::Pose head_;             // for the frame at hand
  bool tracked_ = false;            // head_ is from a tracker
  std::array<double, 4> fitted_{};  // values for which the first view was made; zeros: none yet
  WindowLegend legend_{*window_, options_.display, overlays_};
  struct Shown {
    double at_s = -1e9;
    int width = 0, height = 0;  // the window's size, pixels
    uint64_t overlays = 0;      // Overlays::version()
    bool panel = false;
  };
  Shown shown_;                    // state that the window shows
  int help_scale_ = 0;             // size of the help's letters; 0: it is hidden
  std::vector<std::string> news_;  // shown by an overlay
  Panel panel_;
  SceneControls scene_controls_{[this](Order order) { panel_.order(std::move(order)); }};
  OrderUndo order_undo_;
  SceneViewState scene_view_;
  PanelViewState panel_view_;
  Opening opening_;
  NotesViewState notes_view_;
  NotesWish notes_wish_;
  WidgetLog widget_log_ = WidgetLog::from_environment();
  std::unique_ptr<ControlDesk> desk_;
  bool quad_buffers_ = false;  // the window has quad buffers
  Screenshots screenshots_;
};

/// Returns a camera whose field of view `fov_deg` spans the longer side of the image: a window that is made narrow does
/// not become a tunnel.
geometry::Camera window_camera(const geometry::Pose& pose, double fov_deg, int width, int height, double near_m);

}  // namespace telesplat::viewer
