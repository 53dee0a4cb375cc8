#include "client/displays/window/input/interaction.h"

#include <algorithm>
#include <utility>

namespace telesplat::viewer {
namespace {

// Least time between poses of a recorded path, so that their times also differ in the file.
constexpr double kLeastStep_s = 1e-5;
constexpr double kDoubleClick_s = 0.4, kDoubleClick = 0.01;  // between the clicks; window heights
constexpr double kQuitWithin_s = 3;                          // between the two presses of Q

// True if the key writes a letter when a path is typed.
bool writes(Key key) { return key < Key::kF1; }

}  // namespace

Interaction::Interaction(std::optional<geometry::Trajectory> recorded, const Look& look)
    : recorded_(std::move(recorded)), look_(look), playing_(recorded_.has_value()), held_(kKeys) {}

void Interaction::key(Key key, bool down) {
  const bool was_down = held_[size_t(key)];
  const bool typed = shows_dialog_ && (writes(key) || key == Key::kTab);
  held_[size_t(key)] = down && !typed;
  if (down && !was_down && !typed) press(key);
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
  if (shown && !shows_dialog_) {
    controls_.set_flying(false);
    focus_lost();
  }
  shows_dialog_ = shown;
}

// Closes the topmost thing first. It never ends the program, so one press too many does no harm.
void Interaction::close_what_is_open() {
  if (shows_dialog_ && can_close_)
    shows_dialog_ = false;
  else if (shows_help_)
    shows_help_ = false;
  else if (controls_.flying())
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
  if (!playing_) return;
  playing_ = false;
  if (!tracked_ || std::exchange(plays_path_, false)) return controls_.take_over(recorded_->at(playback_s_));
  if (told_) controls_.take_over(*told_);
}

void Interaction::go_to(const geometry::Pose& pose) {
  move_camera("view", [&] {
    playing_ = plays_path_ = false;
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
  if (!recorded_ && !tracked_) {
    notes_.push_back("no head movement to play: --trajectory names one, C records one");
    return;
  }
  if (playing_) return take_camera();
  controls_.set_flying(false);
  if (!tracked_ && recorded_->duration_s() > 0 && playback_s_ >= recorded_->duration_s()) playback_s_ = 0;
  playing_ = true;
}

void Interaction::begin_path() {
  records_path_ = true;
  path_.clear();
  notes_.push_back("recording the camera's path; C ends it");
}

void Interaction::end_path() {
  if (!records_path_) return;
  records_path_ = false;
  if (path_.size() < 2) {
    notes_.push_back("the camera's path is too short to keep");
    return;
  }
  finished_path_ = std::move(path_);
  path_.clear();
  take_camera();
  recorded_ = geometry::Trajectory::of(finished_path_);
  has_own_path_ = true;
  playback_s_ = 0;
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
  shows_help_ = !shows_help_;
  if (!shows_help_) return;
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
      return records_path_ ? end_path() : begin_path();
    case Key::kF1:
    case Key::kH:
      return show_help();
    case Key::kTab:
      shows_panel_ = !shows_panel_;
      return;
    case Key::kO:
      wishes_[size_t(Wish::kOpen)] = !can_open_;
      return show_dialog(can_open_ && !shows_dialog_);
    case Key::kEscape:
      return close_what_is_open();
    case Key::kQ:
      return quit_or_ask();
    default:
      return;  // held keys
  }
}

void Interaction::button(MouseButton button, bool down) {
  (button == MouseButton::kLeft ? left_ : button == MouseButton::kMiddle ? middle_ : right_) = down;
  if (button != MouseButton::kLeft || !down || controls_.flying()) return;
  const Click now{last_s_.value_or(0), pointer_.value_or(glm::dvec2(0))};
  const bool twice = click_ && now.s - click_->s <= kDoubleClick_s && glm::distance(now.at, click_->at) <= kDoubleClick;
  wishes_[size_t(Wish::kCentre)] = twice;
  click_ = twice ? std::nullopt : std::optional(now);
}

void Interaction::move(double x, double y) {
  const glm::dvec2 to(x, y), from = pointer_.value_or(to);
  pointer_ = to;
  const double dx = to.x - from.x, dy = to.y - from.y;
  const bool shift = held_[size_t(Key::kShift)], panning = middle_ || (left_ && shift);
  if (!controls_.flying() && !left_ && !panning && !right_) return;
  take_camera();
  if (controls_.flying())
    controls_.orbit(dx, dy);
  else if (panning)
    controls_.pan(dx, dy, height_tangent_);
  else if (right_)
    shift ? controls_.roll(dx) : controls_.dolly(dy);
  else
    controls_.orbit(dx, dy);
}

void Interaction::wheel(double steps) {
  take_camera();
  controls_.wheel(steps);
}

void Interaction::focus_lost() {
  std::fill(held_.begin(), held_.end(), false);
  left_ = middle_ = right_ = false;
}

void Interaction::set_scene(scene::Pipeline pipeline, const geometry::Box& box_room, const geometry::Pose& home,
                            double middle_x) {
  pipeline_ = pipeline;
  controls_.set_scene(box_room, home, middle_x);
}

void Interaction::set_recorded(geometry::Trajectory recorded) {
  if (!has_own_path_) recorded_ = std::move(recorded);
}

void Interaction::play(geometry::Trajectory path) {
  plays_path_ = true;
  recorded_ = std::move(path);
  has_own_path_ = playing_ = true;
  playback_s_ = 0;
  controls_.set_flying(false);
}

geometry::Pose Interaction::advance(double now_s, bool playback) {
  const double dt_s = last_s_ ? std::max(0.0, now_s - *last_s_) : 0.0;
  last_s_ = now_s;
  if (std::exchange(goes_home_, false)) {
    if (path_is_over()) take_camera();
    controls_.reset();
  }
  const geometry::Pose pose = next_pose(now_s, dt_s, playback);
  if (records_path_) record_pose(now_s, pose);
  return pose;
}

// True if the head stands at the end of its path.
bool Interaction::path_is_over() const {
  const bool plays = playing_ && (!tracked_ || plays_path_);
  return plays && recorded_->ends() && playback_s_ >= recorded_->duration_s();
}

void Interaction::set_tracked(Tracked tracked) {
  tracked_ = std::move(tracked);
  playing_ = true;
}

geometry::Pose Interaction::next_pose(double now_s, double dt_s, bool playback) {
  if (playing_ && tracked_ && !plays_path_) {
    if (const auto told = tracked_(now_s)) told_ = told;
    return told_ ? *told_ : controls_.advance(dt_s);
  }
  if (playing_) {
    if (playback) playback_s_ += dt_s;
    return recorded_->at(playback_s_);
  }
  const auto axis = [&](Key more, Key less) { return double(held_[size_t(more)]) - double(held_[size_t(less)]); };
  controls_.fly({axis(Key::kD, Key::kA), axis(Key::kE, Key::kQ), axis(Key::kW, Key::kS), held_[size_t(Key::kShift)]});
  return controls_.advance(dt_s);
}

void Interaction::record_pose(double now_s, const geometry::Pose& pose) {
  if (path_.empty()) path_from_s_ = now_s;
  const double t_s = now_s - path_from_s_;
  if (path_.empty() || t_s > path_.back().t_s + kLeastStep_s) path_.push_back({t_s, pose});
}

}  // namespace telesplat::viewer
