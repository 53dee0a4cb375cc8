#include "client/viewer/input/interaction.h"

#include <algorithm>
#include <utility>

namespace telesplat::viewer {

const std::vector<std::string>& key_help() {
  static const std::vector<std::string> lines{
      "left drag            orbit around the data set",
      "middle, shift+left   pan",
      "wheel                nearer, farther (in flight: faster, slower)",
      "F                    fly: W A S D, E up, Q down, the mouse looks around, shift is faster",
      "R                    back to the first view",
      "T                    play the recorded head movement (--trajectory), or take the camera",
      "1 2 3 4              splats: square, disc, ellipse, ewa",
      "5 6 7                finish: fill pin-holes, smooth, antialias",
      "8                    shading on, off",
      "P, F12               screenshot, into the run folder or the current one",
      "H                    these keys",
      "Esc                  leave flight; quit",
      "Q                    quit (not in flight)",
  };
  return lines;
}

Interaction::Interaction(std::optional<geometry::Trajectory> recorded, const Look& look)
    : recorded_(std::move(recorded)), look_(look), playing_(recorded_.has_value()), held_(size_t(Key::kShift) + 1) {}

void Interaction::key(Key key, bool down) {
  const bool was_down = held_[size_t(key)];
  held_[size_t(key)] = down;
  if (down && !was_down) pressed(key);
}

void Interaction::toggle(bool& flag, const char* name) {
  flag = !flag;
  notes_.push_back(std::string(name) + (flag ? " on" : " off"));
}

void Interaction::take_camera() {
  if (!playing_) return;
  playing_ = false;
  controls_.take_over(recorded_->at(playback_s_));
}

void Interaction::pressed(Key key) {
  switch (key) {
    case Key::kF:
      take_camera();
      controls_.set_flying(!controls_.flying());
      return;
    case Key::kR:
      take_camera();
      controls_.reset();
      return;
    case Key::kT:
      if (!recorded_)
        notes_.push_back("no head movement to play: --trajectory names one");
      else if (playing_)
        take_camera();
      else {
        controls_.set_flying(false);
        if (recorded_->duration_s() > 0 && playback_s_ >= recorded_->duration_s()) playback_s_ = 0;
        playing_ = true;
      }
      return;
    case Key::k1:
    case Key::k2:
    case Key::k3:
    case Key::k4:
      if (const auto kernel = splat::kernel_of_key(char('1' + int(key) - int(Key::k1)))) look_.render.kernel = *kernel;
      notes_.push_back("splats: " + std::string(splat::kernel_name(look_.render.kernel)));
      return;
    case Key::k5:
      return toggle(look_.render.finish.fill, "fill");
    case Key::k6:
      return toggle(look_.render.finish.smooth, "smooth");
    case Key::k7:
      return toggle(look_.render.finish.antialias, "antialias");
    case Key::k8:
      return toggle(look_.lit, "shading");
    case Key::kP:
    case Key::kF12:
      screenshot_ = true;
      return;
    case Key::kH:
      notes_.insert(notes_.end(), key_help().begin(), key_help().end());
      return;
    case Key::kEscape:
      if (!controls_.flying()) quit_ = true;
      controls_.set_flying(false);
      return;
    case Key::kQ:
      if (!controls_.flying()) quit_ = true;
      return;
    default:
      return;  // held keys
  }
}

void Interaction::button(MouseButton button, bool down) { (button == MouseButton::kLeft ? left_ : middle_) = down; }

void Interaction::move(double x, double y) {
  const glm::dvec2 to(x, y), from = pointer_.value_or(to);
  pointer_ = to;
  const double dx = to.x - from.x, dy = to.y - from.y;
  const bool panning = middle_ || (left_ && held_[size_t(Key::kShift)]);
  if (!controls_.flying() && !left_ && !panning) return;
  take_camera();
  if (!controls_.flying() && panning)
    controls_.pan(dx, dy, height_tangent_);
  else
    controls_.orbit(dx, dy);
}

void Interaction::wheel(double steps) {
  take_camera();
  controls_.wheel(steps);
}

void Interaction::focus_lost() {
  std::fill(held_.begin(), held_.end(), false);
  left_ = middle_ = false;
}

geometry::Pose Interaction::advance(double now_s, bool playback) {
  const double dt_s = last_s_ ? std::max(0.0, now_s - *last_s_) : 0.0;
  last_s_ = now_s;
  if (playing_) {
    if (playback) playback_s_ += dt_s;
    return recorded_->at(playback_s_);
  }
  const auto axis = [&](Key more, Key less) { return double(held_[size_t(more)]) - double(held_[size_t(less)]); };
  controls_.fly({axis(Key::kD, Key::kA), axis(Key::kE, Key::kQ), axis(Key::kW, Key::kS), held_[size_t(Key::kShift)]});
  return controls_.advance(dt_s);
}

bool Interaction::take_screenshot_wish() { return std::exchange(screenshot_, false); }
std::vector<std::string> Interaction::take_notes() { return std::exchange(notes_, {}); }

}  // namespace telesplat::viewer
