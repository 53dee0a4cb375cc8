// Where the display's cameras come from and where its frames go: a recorded head without a person (headless), a person
// at a window, or a headset. Each kind of display is one implementation; client/displays holds those that need
// libraries of window systems and headsets.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/request_options.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "client/viewer/hands/measurements.h"
#include "client/viewer/input/look.h"
#include "client/viewer/input/tracked_head.h"
#include "client/viewer/render/renderer_trial.h"
#include "common/geometry/trajectory.h"
#include "common/image/file.h"
#include "common/image/legend.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// What is known after a frame. Counters count from the beginning.
struct FrameFigures {
  double now_s = 0;                  ///< monotonic clock
  std::string scene;                 ///< name of the data set; empty until the master told it
  uint64_t frames = 0, updates = 0;  ///< displayed; completely received
  double latency_ms = 0;             ///< of the newest view update, request to complete; 0 before the first
  uint64_t points_drawn = 0, points_cached = 0, bytes_received = 0;
  uint64_t epochs_shown = 0;          ///< times a changed scene took the place of the one on display
  const char* drawn_name = "points";  ///< what points_drawn counts
  const char* cached_name = "";       ///< and points_cached, with a space before it
  double waits_s = 0;                 ///< seconds that the display has waited for a view update; 0: not for long
  double inter_frame_ms = 0;          ///< from the end of the frame before to the end of this one; 0: it was the first
  CouplingState coupling;
  double detail = 1;                          ///< splat::SelectionOptions::detail of the frame
  int sampled_width = 0, sampled_height = 0;  ///< of the newest view request; 0: there was none
  RendererChoice::Figures renderer;
};

/// What the session shows.
struct ShownScene {
  geometry::Box box_room;  ///< empty until the master told it
  scene::Pipeline pipeline = scene::Pipeline::kPoints;
  bool operator==(const ShownScene&) const = default;
};

struct MeasuredFrame;

/// Where a headset expects its head.
struct ExpectedHead {
  double at_s = 0;  ///< monotonic clock
  geometry::Pose pose;
};

/// Called by the display loop, in its thread, in this order for every frame.
class DisplaySurface {
 public:
  virtual ~DisplaySurface() = default;
  /// Begins a frame. False: none can be shown now, after a moment's wait.
  virtual bool ready() { return true; }
  /// Whether ready() waits for the refresh that shows the frame: the loop keeps no pace of its own then.
  virtual bool paces() const { return false; }
  /// Before the next frame, when it is known what there is to show, and again when that changes.
  virtual void on_scene(const ShownScene& scene) = 0;
  /// Takes in what happened since the last frame; returns the camera of the frame that begins, whose size is the
  /// frame's, and changes `look` to the person's wishes. t_s: seconds since the first displayed frame; negative before
  /// it, while the head rests.
  virtual geometry::Camera begin_frame(double now_s, double t_s, Look& look) = 0;
  /// The head whose view begin_frame() returned last, and what it would have returned for another head: viewers of a
  /// wall show what one head sees.
  virtual geometry::Pose head() const = 0;
  /// Both eyes of the frame that begins, left and right, where each has a display of its own; null: they share one.
  virtual const std::array<geometry::Camera, 2>* eyes() const { return nullptr; }
  /// Pictures to be drawn each second, as far as the surface knows; 0: as DisplayOptions::target_fps says.
  virtual double pictures_a_second() const { return 0; }
  /// When the frame at hand is seen; `now_s` where nothing tells.
  virtual double seen_s(double now_s) const { return now_s; }
  /// Whether the head has jumped into another space, once after each jump.
  virtual bool take_jump() { return false; }
  /// Where the head is expected at `at_s` or thereabouts. Nothing: its poses say it all.
  virtual std::optional<ExpectedHead> expected(double /*at_s*/) { return std::nullopt; }
  /// When the pose of head() was taken. Nothing: a trajectory or a hand moves it, so it was taken when the frame began.
  virtual std::optional<PoseMoment> pose_moment() const { return std::nullopt; }
  virtual geometry::Camera camera_of(const geometry::Pose& head) const = 0;
  /// Whether frames without points are worth drawing, because somebody sees them.
  virtual bool visible() const = 0;
  /// Seconds from one refresh of the display to the next; 0: it has none, or they are not known.
  virtual double refresh_s() { return 0; }
  /// The session as its master tells of it, whenever that has changed.
  virtual void on_session(const std::shared_ptr<const wire::Welcome>&) {}
  /// How finely the person wants views to be sampled from now on, once after each change.
  virtual std::optional<SamplingWish> take_sampling() { return std::nullopt; }
  /// How two eyes' pictures share the display from now on, once after each change.
  virtual std::optional<StereoOptions> take_stereo() { return std::nullopt; }
  /// The legend of the frame that is shown next; null: it has none.
  virtual void on_legend(const std::shared_ptr<const image::Legend>&) {}
  /// Shows a finished frame, drawn with the camera above. changed: it is not the one that was shown last.
  virtual void present(const image::View& view, bool changed) = 0;
  /// Shows a finished frame to eyes(); may draw over the views, which have depth.
  virtual void present_eyes(std::array<image::View, 2>& /*views*/) {}
  /// Corrects when the frame that was presented last is seen, where that is later.
  virtual void measure(MeasuredFrame& /*frame*/) {}
  /// Whether somebody wants the frame that begins as a picture.
  virtual bool wants_picture() const { return false; }
  /// It is this one. alpha: what the upper byte of its colours is.
  virtual void take_picture(const image::View&, image::Alpha) {}
  /// A picture of another size than the display's, or with depth, once after each wish; `camera` becomes what it shows.
  virtual std::optional<PictureWish> take_picture_wish(geometry::Camera& /*camera*/) { return std::nullopt; }
  /// It is this one.
  virtual void take_wished_picture(const PictureWish&, image::View, image::Alpha) {}
  /// After the frame's bookkeeping.
  virtual void report(const FrameFigures& figures) = 0;
  /// A place of the frame that was displayed of which somebody wants to know what lies there: a share of its width and
  /// height, from the upper left corner; nothing: nobody does.
  virtual std::optional<glm::dvec2> points_at() { return std::nullopt; }
  /// What lies there, in this epoch; nothing: nothing does.
  virtual void on_pick(const std::optional<Pick>&, EpochId) {}
  /// What the person measured; null: this display shows none.
  virtual Measurements* measurements() { return nullptr; }
  /// What the session's data are told in; null: that is not known yet.
  virtual void on_terms(const std::shared_ptr<const SceneTerms>&) {}
  /// Puts the camera there, at once. False: the head follows a trajectory.
  virtual bool go_to(const geometry::Pose&) { return false; }
  /// FrameHands::set().
  virtual Status set(const std::string& /*name*/, const std::string& /*value*/) {
    return Error{"nobody sees this viewer's display"};
  }
  /// Whether the person is done.
  virtual bool wants_to_stop() const = 0;
  /// Why it can show nothing any more; empty: it can. It wants to stop then.
  virtual std::string failure() const { return {}; }
};

}  // namespace telesplat::viewer
