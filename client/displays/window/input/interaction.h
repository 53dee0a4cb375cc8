// What a person does at the window - keys, mouse, wheel - and what follows from it. Without any window system, so that
// it is tested without one.
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

/// What a person asks others for, by keys and clicks.
enum class Wish {
  kScreenshot,
  kFullscreen,
  kOpen,      ///< another data set, where there is no dialog for it
  kOverlays,  ///< shows or hides axes, scale and cursor
  kPick,
  kBookmark,      ///< keeps one
  kNextBookmark,  ///< leads to it
  kCentre         ///< centre_on() what lies under the pointer
};
inline constexpr size_t kWishes = size_t(Wish::kCentre) + 1;

class Interaction {
 public:
  using Path = std::vector<geometry::Trajectory::Sample>;

  /// recorded: a head movement that T plays; without, T does nothing. It plays from the beginning if there is one.
  Interaction(std::optional<geometry::Trajectory> recorded, const Look& look);
  Interaction(const Interaction&) = delete;  // what can be undone refers to it
  Interaction& operator=(const Interaction&) = delete;

  // ---- events; positions and movements in window heights, +y down ----
  void key(Key key, bool down);
  /// What a button of the panel does that stands for a key.
  void press(Key key);
  /// A letter while control is held down, and perhaps shift: the one that is printed on the key, in upper case.
  void control(char letter, bool shift = false);
  /// The same while shift alone is. False: it means what it means without.
  bool shifted(char letter);
  void button(MouseButton button, bool down);
  void move(double x, double y);
  void wheel(double steps);
  /// Keys and buttons that are released elsewhere are never heard of: all count as released.
  void focus_lost();

  // ---- every frame ----
  /// What there is to see, its box, and the view that R leads back to.
  /// Home shows the middle of it at the tangent middle_x.
  void set_scene(scene::Pipeline pipeline, const geometry::Box& box_room, const geometry::Pose& home,
                 double middle_x = 0);
  scene::Pipeline pipeline() const { return pipeline_; }
  /// What T plays from now on, unless the person recorded a path.
  void set_recorded(geometry::Trajectory recorded);
  /// What R does, but whoever has the camera keeps it: to the first view of the scene that is told before the next
  /// advance().
  void back_to_first_view() { goes_home_ = true; }
  /// T plays this from now on, and it plays at once; then T goes back to who tells where the head is, if somebody does.
  void play(geometry::Trajectory path);
  bool can_play() const { return recorded_.has_value(); }
  /// From now on somebody else tells where the head is (nothing: not yet), until the person takes the camera; T goes
  /// back to it.
  using Tracked = std::function<std::optional<geometry::Pose>(double now_s)>;
  void set_tracked(Tracked tracked);
  /// What the window shows, top to bottom, at distance 1: pans follow the pointer.
  void set_height_tangent(double tangent) { height_tangent_ = tangent; }
  /// The camera at `now_s`. A recorded movement advances only while `playback` is true.
  geometry::Pose advance(double now_s, bool playback);

  const Look& look() const { return look_; }
  /// In place of what keys chose; they go on from it. It is no deed of the person's.
  void set_look(const Look& look) { look_ = look; }
  bool wants_to_quit() const { return quit_; }
  /// In flight the mouse turns the head: the pointer should be caught and hidden.
  bool wants_pointer() const { return controls_.flying(); }
  bool playing() const { return playing_; }
  bool shows_help() const { return shows_help_; }
  bool shows_panel() const { return shows_panel_; }
  void show_panel(bool shown) { shows_panel_ = shown; }
  /// The dialog that opens data sets. While it is shown no letter is a command, and Escape closes it, unless it is all
  /// that there is to look at.
  bool shows_dialog() const { return shows_dialog_; }
  void show_dialog(bool shown);
  /// Whether there is such a dialog, and whether there is something to look at beside it.
  void set_dialog(bool can_open, bool can_close) { can_open_ = can_open, can_close_ = can_close; }
  /// For the lines that tell of keys.
  void set_key_names(KeyNames names) { key_names_ = std::move(names); }
  bool records_path() const { return records_path_; }
  /// Seconds of the path that is being recorded.
  double path_s() const { return path_.empty() ? 0 : path_.back().t_s; }
  /// The camera's path that was recorded last, once; T plays it from now on. Empty: there is none.
  Path take_path() { return std::exchange(finished_path_, {}); }
  /// A path that is being recorded ends.
  void end_path();
  bool wants(Wish wish) const { return wishes_[size_t(wish)]; }
  /// True once after each time that the person asked for it.
  bool take(Wish wish) { return std::exchange(wishes_[size_t(wish)], false); }
  /// Where the pointer is, in window heights; nothing: it was not seen yet, or is caught.
  std::optional<glm::dvec2> pointer() const { return wants_pointer() ? std::nullopt : pointer_; }
  /// The side that somebody wants to see the data from, once after each press of its keys.
  std::optional<Side> take_side_wish() { return std::exchange(side_wish_, std::nullopt); }
  /// The person's camera goes on from there, at once.
  void go_to(const geometry::Pose& pose);
  /// The person's camera goes there. what: for the line of undo.
  void travel(const geometry::Pose& pose, const std::string& what);
  void centre_on(const glm::dvec3& place_room);
  /// What was done to the picture.
  UndoStack& undo() { return undo_; }
  /// Lines to tell the person, since the last call.
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
  std::optional<geometry::Pose> told_;  // by it
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
  bool plays_path_ = false;  // although somebody tells where the head is
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
  std::optional<Click> click_;            // of the left button; the next may make it a double one
  std::optional<Side> side_wish_, side_;  // side_: the one that was asked for last
  UndoStack undo_;
  std::vector<std::string> notes_;
};

}  // namespace telesplat::viewer
