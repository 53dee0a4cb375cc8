// Turns a person's keys, mouse and wheel at the window into movements and wishes. It needs no window system, so it is
// tested without one.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/displays/window/input/camera_controls.h"
#include "client/displays/window/input/head_path.h"
#include "client/displays/window/input/held_input.h"
#include "client/displays/window/input/undo.h"
#include "client/viewer/input/keys.h"
#include "client/viewer/input/look.h"
#include "common/scene/kind.h"

namespace telesplat::viewer {

/// Wishes of keys and clicks that other parts of the window carry out.
enum class Wish {
  kScreenshot,
  kFullscreen,
  kOpen,      ///< another data set, if there is no dialog for it
  kOverlays,  ///< shows or hides axes, scale and cursor
  kPick,
  kBookmark,      ///< keeps a bookmark
  kNextBookmark,  ///< goes to the next bookmark
  kCentre         ///< centre_on() the content under the pointer
};
inline constexpr size_t kWishes = size_t(Wish::kCentre) + 1;

/// Parts of the window that are open over the picture.
struct OpenParts {
  bool help = false, panel = false;
  bool dialog = false;    ///< the dialog that opens data sets; Interaction::show_dialog() sets it
  bool can_open = false;  ///< there is such a dialog
  bool can_close = true;  ///< there is something to see beside it
  void allow(bool opening, bool closing) { can_open = opening, can_close = closing; }
  /// Closes the topmost of dialog and help. False: neither can be closed.
  bool close() {
    if (!(dialog && can_close) && !help) return false;
    (dialog && can_close ? dialog : help) = false;
    return true;
  }
};

class Interaction {
 public:
  /// recorded: a head movement that T plays, from the beginning of the session on; without it T does nothing.
  Interaction(std::optional<geometry::Trajectory> recorded, const Look& look);
  Interaction(const Interaction&) = delete;  // undo steps refer to it
  Interaction& operator=(const Interaction&) = delete;

  // ---- events; positions and movements in window heights, +y down ----
  void key(Key key, bool down);
  /// A button of the panel was pressed that stands for this key.
  void press(Key key);
  /// A letter was typed with control, and perhaps shift: the print on the key, in upper case.
  void control(char letter, bool shift = false);
  /// A letter was typed with shift only. False: shift changes nothing.
  bool shifted(char letter);
  void button(MouseButton button, bool down);
  void move(double x, double y);
  void wheel(double steps);
  /// The window does not get the release of keys and buttons elsewhere: all count as released.
  void focus_lost();

  // ---- every frame ----
  /// Sets the scene's box, and the view to which R returns. Home shows the middle of the box at the tangent middle_x.
  void set_scene(scene::Pipeline pipeline, const geometry::Box& box_room, const geometry::Pose& home,
                 double middle_x = 0);
  scene::Pipeline pipeline() const { return pipeline_; }
  /// Sets the movement that T plays, unless the person recorded a path.
  void set_recorded(geometry::Trajectory recorded) { playback_.set_recorded(std::move(recorded)); }
  /// Does what R does, but does not take the camera: goes to the first view of the scene that is set before the next
  /// advance().
  void back_to_first_view() { goes_home_ = true; }
  /// Plays this path at once; T plays it from now on. Afterwards T returns to the tracker, if there is one.
  void play(geometry::Trajectory path);
  bool can_play() const { return playback_.has_recorded(); }
  /// From now on a tracker moves the head (nothing: no pose yet) until the person takes the camera; T returns to it.
  void set_tracked(HeadPlayback::Tracked tracked) { playback_.set_tracked(std::move(tracked)); }
  /// Sets the height of the window's view at distance 1, so that pans follow the pointer.
  void set_height_tangent(double tangent) { height_tangent_ = tangent; }
  /// Returns the camera at `now_s`. A recorded movement advances only while `playback` is true.
  const geometry::Pose& advance(double now_s, bool playback);
  /// As advance() returned it last. tracked(): it is the tracker's.
  const geometry::Pose& pose() const { return pose_; }
  bool tracked() const { return playback_.tracked(); }

  const Look& look() const { return look_; }
  /// Replaces the look that keys chose; they go on from it. The change is not in the undo stack.
  void set_look(const Look& look) { look_ = look; }
  bool wants_to_quit() const { return quit_; }
  /// True in flight: the mouse turns the head, so the pointer should be caught and hidden.
  bool wants_pointer() const { return controls_.flying(); }
  bool playing() const { return playback_.playing(); }
  OpenParts& open() { return open_; }
  /// Shows or hides the dialog that opens data sets. While it is shown no letter is a command, and Escape closes it,
  /// unless there is nothing else to see.
  void show_dialog(bool shown);
  /// Sets key names for lines about keys.
  void set_key_names(KeyNames names) { key_names_ = std::move(names); }
  /// The camera's path that is being recorded; once it is complete, T plays it.
  PathRecorder& path() { return path_; }
  /// Ends a path that is being recorded.
  void end_path();
  bool wants(Wish wish) const { return wishes_[size_t(wish)]; }
  /// True once after each time that the person asked for it.
  bool take(Wish wish) { return std::exchange(wishes_[size_t(wish)], false); }
  /// Place of the pointer, in window heights; nothing: not known yet, or the pointer is caught.
  std::optional<glm::dvec2> pointer() const { return wants_pointer() ? std::nullopt : held_.pointer(); }
  /// Returns the side from which the person wants to see the data, once after each press of a side's keys.
  std::optional<Side> take_side_wish() { return std::exchange(side_wish_, std::nullopt); }
  /// Moves the person's camera to this pose at once; it goes on from there.
  void go_to(const geometry::Pose& pose);
  /// Lets the person's camera travel to this pose. what: for the line of undo.
  void travel(const geometry::Pose& pose, const std::string& what);
  void centre_on(const glm::dvec3& place_room);
  /// The person's changes to the picture.
  UndoStack& undo() { return undo_; }
  /// Returns lines for the person since the last call.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }

 private:
  bool make_wish(Key key);
  void close_what_is_open();
  void quit_or_ask();
  void play_or_take();
  bool choose_look(Key key);
  void change_look(const Look& look);
  void move_camera(const std::string& what, const std::function<void()>& move);
  void show_help();
  void take_camera();
  void begin_path();

  HeadPlayback playback_;
  geometry::Pose pose_;
  PathRecorder path_;
  HeldInput held_;
  OpenParts open_;
  Look look_;
  CameraControls controls_;
  scene::Pipeline pipeline_ = scene::Pipeline::kPoints;
  std::array<bool, kWishes> wishes_{};
  bool quit_ = false;
  std::optional<double> asked_to_quit_s_;
  KeyNames key_names_ = us_name;
  bool goes_home_ = false;  // with the next frame
  double height_tangent_ = 1;
  std::optional<double> last_s_;
  std::optional<Side> side_wish_, side_;  // side_: the last wish
  UndoStack undo_;
  std::vector<std::string> notes_;
};

}  // namespace telesplat::viewer
