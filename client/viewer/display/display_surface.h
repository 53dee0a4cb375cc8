// Gives the display its cameras and shows its frames: for a recorded head without a person (headless), a person at a
// window, or a headset. Each kind of display is one implementation; client/displays has those that need libraries of
// window systems and headsets.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "client/viewer/coupling/request_options.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "client/viewer/hands/measurements.h"
#include "client/viewer/input/look.h"
#include "client/viewer/input/tracked_head.h"
#include "common/geometry/trajectory.h"
#include "common/image/file.h"
#include "common/image/legend.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// The scene that the session shows.
struct ShownScene {
  geometry::Box box_room;  ///< empty until the master sent it
  scene::Pipeline pipeline = scene::Pipeline::kPoints;
  bool operator==(const ShownScene&) const = default;
};

struct FrameFigures;
struct Seen;

/// A pose that a headset expects for its head.
struct ExpectedHead {
  double at_s = 0;  ///< monotonic clock
  geometry::Pose pose;
};

/// Called by the display loop, in its thread, in this order for every frame.
class DisplaySurface {
 public:
  virtual ~DisplaySurface() = default;
  /// Begins a frame. False, after a moment's wait: no frame can be shown now.
  virtual bool ready() { return true; }
  /// True if ready() waits for the refresh that shows the frame: then the loop keeps no pace of its own.
  virtual bool paces() const { return false; }
  /// Called before the next frame when the scene is known, and again when it changes.
  virtual void on_scene(const ShownScene& scene) = 0;
  /// Takes in what happened since the last frame. Returns the camera of the frame that begins, with the frame's size,
  /// and changes `look` to the person's wishes. t_s: seconds since the first displayed frame; negative before it, while
  /// the head rests.
  virtual geometry::Camera begin_frame(double now_s, double t_s, Look& look) = 0;
  /// The head whose view begin_frame() returned last. camera_of(): its camera for another head: viewers of a wall show
  /// what one head sees.
  virtual geometry::Pose head() const = 0;
  /// Both eyes of the frame that begins, left and right, if each has a display of its own; null: they share one.
  virtual const std::array<geometry::Camera, 2>* eyes() const { return nullptr; }
  /// Pictures to draw each second, as far as the surface knows; 0: as DisplayOptions::target_fps says.
  virtual double pictures_a_second() const { return 0; }
  /// When the frame at hand will be seen; `now_s` if that is not known.
  virtual double seen_s(double now_s) const { return now_s; }
  /// True once after each jump of the head into another space.
  virtual bool take_jump() { return false; }
  /// Returns the pose expected for the head at about `at_s`. Nothing: its poses are all that is known.
  virtual std::optional<ExpectedHead> expected(double /*at_s*/) { return std::nullopt; }
  /// When the pose of head() was taken. Nothing: a trajectory or a hand moves it, so it was taken when the frame began.
  virtual std::optional<PoseMoment> pose_moment() const { return std::nullopt; }
  virtual geometry::Camera camera_of(const geometry::Pose& head) const = 0;
  /// True if frames without points are worth drawing, because a person sees them.
  virtual bool visible() const = 0;
  /// Seconds from one refresh of the display to the next; 0: it has no refreshes, or they are not known.
  virtual double refresh_s() { return 0; }
  /// Gives the session from its master, each time it has changed.
  virtual void on_session(const std::shared_ptr<const wire::Welcome>&) {}
  /// Returns the person's new wish for the sampling of views, once after each change.
  virtual std::optional<SamplingWish> take_sampling() { return std::nullopt; }
  /// Returns the new way in which two eyes' pictures share the display, once after each change.
  virtual std::optional<StereoOptions> take_stereo() { return std::nullopt; }
  /// Gives the legend of the frame that is shown next; null: it has no legend.
  virtual void on_legend(const std::shared_ptr<const image::Legend>&) {}
  /// Shows a finished frame, drawn with the camera above. changed: it differs from the one shown last.
  virtual void present(const image::View& view, bool changed) = 0;
  /// Shows a finished frame to eyes(); may draw over the views, which have depth.
  virtual void present_eyes(std::array<image::View, 2>& /*views*/) {}
  /// Corrects the time at which the frame presented last, at `presented_s`, is seen, if that is later.
  virtual void measure(Seen& /*seen*/, double /*presented_s*/) {}
  /// True if a person or an order wants the frame that begins as a picture.
  virtual bool wants_picture() const { return false; }
  /// Takes that picture. alpha: meaning of its colours' upper byte.
  virtual void take_picture(const image::View&, image::Alpha) {}
  /// Returns a wish for a picture of another size, or with depth, once after each wish; `camera` becomes the picture's.
  virtual std::optional<PictureWish> take_picture_wish(geometry::Camera& /*camera*/) { return std::nullopt; }
  /// Takes that picture.
  virtual void take_wished_picture(const PictureWish&, image::View, image::Alpha) {}
  /// Called after the frame's bookkeeping.
  virtual void report(const FrameFigures& figures) = 0;
  /// Returns the place of the displayed frame at which a person or an order wants a value: a share of its width and
  /// height, from the upper left corner. Nothing: no value is wanted.
  virtual std::optional<glm::dvec2> points_at() { return std::nullopt; }
  /// Gives the content at that place, in this epoch; nothing: the place is empty.
  virtual void on_pick(const std::optional<Pick>&, EpochId) {}
  /// Measurements that the person made; null: this display shows no measurements.
  virtual Measurements* measurements() { return nullptr; }
  /// Gives units and names of the session's data; null: they are not known yet.
  virtual void on_terms(const std::shared_ptr<const SceneTerms>&) {}
  /// Puts the camera there at once. False: the head follows a trajectory.
  virtual bool go_to(const geometry::Pose&) { return false; }
  /// FrameHands::set().
  virtual Status set(const std::string& /*name*/, const std::string& /*value*/) {
    return Error{"nobody sees this viewer's display"};
  }
  /// True if the person is done.
  virtual bool wants_to_stop() const = 0;
  /// Reason why it can show nothing any more, so that it wants to stop; empty: it can.
  virtual std::string failure() const { return {}; }
};

}  // namespace telesplat::viewer
