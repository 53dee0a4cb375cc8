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

class Interaction {
 public:
  using Path = std::vector<geometry::Trajectory::Sample>;

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
  void set_recorded(geometry::Trajectory recorded);
  /// Does what R does, but does not take the camera: goes to the first view of the scene that is set before the next
  /// advance().
  void back_to_first_view() { goes_home_ = true; }
  /// Plays this path at once; T plays it from now on. Afterwards T returns to the tracker, if there is one.
  void play(geometry::Trajectory path);
  bool can_play() const { return recorded_.has_value(); }
  /// From now on a tracker moves the head (nothing: no pose yet) until the person takes the camera; T returns to it.
  using Tracked = std::function<std::optional<geometry::Pose>(double now_s)>;
  void set_tracked(Tracked tracked);
  /// Sets the height of the window's view at distance 1, so that pans follow the pointer.
  void set_height_tangent(double tangent) { height_tangent_ = tangent; }
  /// Returns the camera at `now_s`. A recorded movement advances only while `playback` is true.
  geometry::Pose advance(double now_s, bool playback);

  const Look& look() const { return look_; }
  /// Replaces the look that keys chose; they go on from it. The change is not in the undo stack.
  void set_look(const Look& look) { look_ = look; }
  bool wants_to_quit() const { return quit_; }
  /// True in flight: the mouse turns the head, so the pointer should be caught and hidden.
  bool wants_pointer() const { return controls_.flying(); }
  bool playing() const { return playing_; }
  bool shows_help() const { return shows_help_; }
  bool shows_panel() const { return shows_panel_; }
  void show_panel(bool shown) { shows_panel_ = shown; }
  /// The dialog that opens data sets. While it is shown no letter is a command, and Escape closes it, unless there is
  /// nothing else to see.
  bool shows_dialog() const { return shows_dialog_; }
  void show_dialog(bool shown);
  /// can_open: there is such a dialog. can_close: there is something to see beside it.
  void set_dialog(bool can_open, bool can_close) { can_open_ = can_open, can_close_ = can_close; }
  /// Sets key names for lines about keys.
  void set_key_names(KeyNames names) { key_names_ = std::move(names); }
  bool records_path() const { return records_path_; }
  /// Length of the path that is being recorded, seconds.
  double path_s() const { return path_.empty() ? 0 : path_.back().t_s; }
  /// Returns the camera's path that was recorded last, once; T plays it from now on. Empty: there is no new path.
  Path take_path() { return std::exchange(finished_path_, {}); }
  /// Ends a path that is being recorded.
  void end_path();
  bool wants(Wish wish) const { return wishes_[size_t(wish)]; }
  /// True once after each time that the person asked for it.
  bool take(Wish wish) { return std::exchange(wishes_[size_t(wish)], false); }
  /// Place of the pointer, in window heights; nothing: not known yet, or the pointer is caught.
  std::optional<glm::dvec2> pointer() const { return wants_pointer() ? std::nullopt : pointer_; }
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
  bool path_is_over() const;
  void show_help();
  void take_camera();
  void begin_path();
  void record_pose(double now_s, const geometry::Pose& pose);
  geometry::Pose next_pose(double now_s, double dt_s, bool playback);

  std::optional<geometry::Trajectory> recorded_;
  Tracked tracked_;
  std::optional<geometry::Pose> told_;  // newest pose from tracked_
  Look look_;
  CameraControls controls_;
  scene::Pipeline pipeline_ = scene::Pipeline::kPoints;
  std::array<bool, kWishes> wishes_{};
  bool playing_ = false, quit_ = false, shows_help_ = false, shows_panel_ = false;
  bool shows_dialog_ = false, can_open_ = false, can_close_ = true;
  std::optional<double> asked_to_quit_s_;
  KeyNames key_names_ = us_name;
  bool records_path_ = false, has_own_path_ = false;
  bool goes_home_ = false;   // with the next frame
  bool plays_path_ = false;  // although there is a tracker
  double path_from_s_ = 0;
  Path path_, finished_path_;
  double playback_s_ = 0, height_tangent_ = 1;
  std::optional<double> last_s_;
  std::optional<glm::dvec2> pointer_;
  std::vector<bool> held_;
  bool left_ = false, middle_ = false, right_ = false;
  struct Click {
    double s = 0;
    glm::dvec2 at{0.0};
  };
  std::optional<Click> click_;            // last click of the left button; the next may make it a double click
  std::optional<Side> side_wish_, side_;  // side_: the last wish
  UndoStack undo_;
  std::vector<std::string> notes_;
};

}  // namespace telesplat::viewer
