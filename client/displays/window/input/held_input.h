// Keys and buttons that a person holds, and the pointer. Positions are in window heights, +y down.
#pragma once

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <utility>

#include "client/viewer/input/keys.h"

namespace telesplat::viewer {

class HeldInput {
 public:
  /// True if the key goes down.
  bool key(Key key, bool down) { return !std::exchange(keys_[size_t(key)], down) && down; }
  bool held(Key key) const { return keys_[size_t(key)]; }
  bool held(MouseButton button) const { return buttons_[size_t(button)]; }
  /// 1: only `more` is held; -1: only `less`; else 0.
  double axis(Key more, Key less) const { return double(held(more)) - double(held(less)); }
  void button(MouseButton button, bool down) { buttons_[size_t(button)] = down; }
  /// A click of the left button at now_s. True if it makes a double click.
  bool click(double now_s) {
    const Click now{now_s, pointer_.value_or(glm::dvec2(0))};
    const bool twice = click_ && now.s - click_->s <= kDoubleClick_s && glm::distance(now.at, click_->at) <= kNear;
    click_ = twice ? std::nullopt : std::optional(now);
    return twice;
  }
  /// Moves the pointer. Returns its movement.
  glm::dvec2 move(const glm::dvec2& to) { return to - std::exchange(pointer_, to).value_or(to); }
  /// Nothing: not known yet.
  const std::optional<glm::dvec2>& pointer() const { return pointer_; }
  void release_all() { keys_ = {}, buttons_ = {}; }

 private:
  static constexpr double kDoubleClick_s = 0.4, kNear = 0.01;  // between the clicks; window heights
  struct Click {
    double s = 0;
    glm::dvec2 at{0.0};
  };
  std::array<bool, kKeys> keys_{};
  std::array<bool, 3> buttons_{};
  std::optional<glm::dvec2> pointer_;
  std::optional<Click> click_;  // last click; the next may make it a double click
};

}  // namespace telesplat::viewer
