#include "client/displays/window/input/interaction.h"

#include <algorithm>
#include <utility>

namespace telesplat::viewer {
namespace {

constexpr double kQuitWithin_s = 3;  // between the two presses of Q

// True if the key writes a letter when a path is typed.
bool writes(Key key) { return key < Key::kF1; }

}  // namespace

Interaction::Interaction(std::optional<geometry::Trajectory> recorded, const Look& look)
    : playback_(std::move(recorded)), look_(look) {}

void Interaction::key(Key key, bool down) {
  const bool typed = open_.dialog && (writes(key) || key == Key::kTab);
  if (held_.key(key, down && !typed)) press(key);
}

void Interaction::control(char letter, bool shift) {
  if (letter == 'Q') quit_ = true;
  if (letter == 'Z' && !shift) notes_.push_back(undo_.undo());
  if (letter == 'Y' || (letter == 'Z' && shift)) notes_.push_back(undo_.redo());
}

bool Interaction::shifted(char letter) {
  if (letter < 'X' || letter > 'Z' || controls_.flying()) return false;
  const Side side{letter - 'X', false};
  side_ = side_wish_ = side_ == side ? Side{side.axis, true} : side;
  return true;
}

void Interaction::show_dialog(bool shown) {
  if (shown && !open_.dialog) {
    controls_.set_flying(false);
    focus_lost();
  }
  open_.dialog = shown;
}

// Closes the topmost thing first. It never ends the program, so one press too many does no harm.
void Interaction::close_what_is_open() {
  if (open_.close()) return;
  if (controls_.flying())
    controls_.set_flying(false);
  else
    notes_.push_back("Ctrl+Q quits");
}

void Interaction::quit_or_ask() {
  if (controls_.flying()) return;
  const double now_s = last_s_.value_or(0);
  quit_ = quit_ || (asked_to_quit_s_ && now_s - *asked_to_quit_s_ <= kQuitWithin_s);
  asked_to_quit_s_ = now_s;
  if (!quit_) notes_.push_back("press " + key_names_(Key::kQ) + " once more to quit");
}

// Undo takes back the change by keys, but not later changes by others.
void Interaction::change_look(const Look& look) {
  if (look == look_) return;
  const auto become = [this](const Look& from, const Look& to) {
    return [this, from, to] { look_ = changed(look_, from, to); };
  };
  undo_.did(last_s_.value_or(0), {"look", become(look, look_), become(look_, look), ""});
  look_ = look;
}

void Interaction::move_camera(const std::string& what, const std::function<void()>& move) {
  take_camera();
  const CameraControls::View before = controls_.view();
  move();
  const auto go = [this](const CameraControls::View& to) {
    take_camera();
    controls_.travel(to);
  };
  undo_.did(last_s_.value_or(0),
            {what, [go, before] { go(before); }, [go, after = controls_.view()] { go(after); }, ""});
}

void Interaction::take_camera() {
  if (const auto pose = playback_.stop()) controls_.take_over(*pose);
}

void Interaction::go_to(const geometry::Pose& pose) {
  move_camera("view", [&] {
    playback_.forget();
    controls_.set_flying(false);
    controls_.take_over(pose, true);
  });
}

void Interaction::travel(const geometry::Pose& pose, const std::string& what) {
  move_camera(what, [&] { controls_.travel(pose); });
}

void Interaction::centre_on(const glm::dvec3& place) {
  move_camera("centre", [&] { controls_.centre_on(place); });
}

void Interaction::play_or_take() {
  if (!playback_.can_play()) {
    notes_.push_back("no head movement to play: --trajectory names one, C records one");
    return;
  }
  if (playing()) return take_camera();
  controls_.set_flying(false);
  playback_.play();
}

void Interaction::begin_path() {
  path_.begin();
  notes_.push_back("recording the camera's path; C ends it");
}

void Interaction::end_path() {
  if (!path_.records()) return;
  const auto path = path_.end();
  if (!path) return notes_.push_back("the camera's path is too short to keep");
  take_camera();
  playback_.set_own(geometry::Trajectory::of(*path));
}

// If the key sets how points are drawn, sets that and returns true.
bool Interaction::choose_look(Key key) {
  if (key < Key::k1 || key > Key::k8) return false;
  const int number = int(key) - int(Key::k1) + 1;
  Look look = look_;
  const auto toggle = [&](bool& flag, const char* name) {
    flag = !flag;
    notes_.push_back(std::string(name) + (flag ? " on" : " off"));
  };
  if (pipeline_ != scene::Pipeline::kPoints) {
    notes_.push_back("key " + std::to_string(number) +
                     (pipeline_ == scene::Pipeline::kSlices ? " has no meaning for volumes"
                                                            : " changes nothing in pictures that servers draw"));
    return true;
  }
  if (key == Key::k5) {
    toggle(look.render.finish.fill, "fill");
  } else if (key == Key::k6) {
    toggle(look.render.finish.smooth, "smooth");
  } else if (key == Key::k7) {
    toggle(look.render.finish.antialias, "antialias");
  } else if (key == Key::k8) {
    toggle(look.lit, "shading");
  } else {
    if (const auto kernel = splat::kernel_of_key(char('0' + number))) look.render.kernel = *kernel;
    notes_.push_back("splats: " + std::string(splat::kernel_name(look.render.kernel)));
  }
  change_look(look);
  return true;
}

void Interaction::show_help() {
  open_.help = !open_.help;
  if (!open_.help) return;
  for (auto& line : key_help(key_names_)) notes_.push_back(std::move(line));
}

// If the key stands for a wish, makes it and returns true.
bool Interaction::make_wish(Key key) {
  static constexpr std::pair<Key, Wish> kKeyWishes[] = {{Key::kP, Wish::kScreenshot},   {Key::kF12, Wish::kScreenshot},
                                                        {Key::kF11, Wish::kFullscreen}, {Key::kB, Wish::kBookmark},
                                                        {Key::kN, Wish::kNextBookmark}, {Key::kI, Wish::kOverlays},
                                                        {Key::kX, Wish::kPick}};
  for (const auto& [of, wish] : kKeyWishes)
    if (of == key) return wishes_[size_t(wish)] = true;
  return false;
}

void Interaction::press(Key key) {
  if (choose_look(key) || make_wish(key)) return;
  switch (key) {
    case Key::kF:
      take_camera();
      controls_.set_flying(!controls_.flying());
      return;
    case Key::kR:
      return move_camera("first view", [this] { controls_.reset(); });
    case Key::kT:
      return play_or_take();
    case Key::kC:
      return path_.records() ? end_path() : begin_path();
    case Key::kF1:
    case Key::kH:
      return show_help();
    case Key::kTab:
      open_.panel = !open_.panel;
      return;
    case Key::kO:
      wishes_[size_t(Wish::kOpen)] = !open_.can_open;
      return show_dialog(open_.can_open && !open_.dialog);
    case Key::kEscape:
      return close_what_is_open();
    case Key::kQ:
      return quit_or_ask();
    default:
      return;  // held keys
  }
}

void Interaction::button(MouseButton button, bool down) {
  held_.button(button, down);
  if (button != MouseButton::kLeft || !down || controls_.flying()) return;
  wishes_[size_t(Wish::kCentre)] = held_.click(last_s_.value_or(0));
}

void Interaction::move(double x, double y) {
  const glm::dvec2 by = held_.move({x, y});
  const bool left = held_.held(MouseButton::kLeft), right = held_.held(MouseButton::kRight);
  const bool shift = held_.held(Key::kShift), panning = held_.held(MouseButton::kMiddle) || (left && shift);
  if (!controls_.flying() && !left && !panning && !right) return;
  take_camera();
  if (controls_.flying())
    controls_.orbit(by.x, by.y);
  else if (panning)
    controls_.pan(by.x, by.y, height_tangent_);
  else if (right)
    shift ? controls_.roll(by.x) : controls_.dolly(by.y);
  else
    controls_.orbit(by.x, by.y);
}

void Interaction::wheel(double steps) {
  take_camera();
  controls_.wheel(steps);
}

void Interaction::focus_lost() { held_.release_all(); }

void Interaction::set_scene(scene::Pipeline pipeline, const geometry::Box& box_room, const geometry::Pose& home,
                            double middle_x) {
  pipeline_ = pipeline;
  controls_.set_scene(box_room, home, middle_x);
}

void Interaction::play(geometry::Trajectory path) {
  playback_.play(std::move(path));
  controls_.set_flying(false);
}

const geometry::Pose& Interaction::advance(double now_s, bool playback) {
  const double dt_s = last_s_ ? std::max(0.0, now_s - *last_s_) : 0.0;
  last_s_ = now_s;
  if (std::exchange(goes_home_, false)) {
    if (playback_.over()) take_camera();
    controls_.reset();
  }
  const auto played = playback_.next(now_s, dt_s, playback);
  if (!playing())
    controls_.fly({held_.axis(Key::kD, Key::kA), held_.axis(Key::kE, Key::kQ), held_.axis(Key::kW, Key::kS),
                   held_.held(Key::kShift)});
  pose_ = played ? *played : controls_.advance(dt_s);
  path_.add(now_s, pose_);
  return pose_;
}

}  // namespace telesplat::viewer
