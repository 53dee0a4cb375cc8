// What a person cuts away of the data: a box along the data's axes that sliders move, or any order of `telesplat ctl
// clip`. Orders come out. No window, no OpenGL, no sockets.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "client/displays/window/panel/order.h"
#include "common/scene/clip_order.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// One thread.
class CutControls {
 public:
  using Give = std::function<void(Order)>;
  static constexpr double kPatience_s = 3;  ///< what was set is shown until the session has it, so long

  explicit CutControls(Give give) : give_(std::move(give)) {}

  void on_session(double now_s, const wire::Welcome& session);
  void on_refusal() { wished_.reset(); }

  /// The order in force, or the one that was given and is not yet; empty: nothing is cut away.
  const std::string& order() const { return wished_ ? wished_->order : order_; }
  /// Whether the data server told the box that sliders move in.
  bool knows_box() const { return !placement_.box_data.empty(); }
  std::string unit() const { return placement_.unit; }

  /// What is kept along an axis, per cent of the data's box.
  struct Kept {
    double from = 0, to = 100;
    bool operator==(const Kept&) const = default;
  };
  /// As far as the order is of planes across the axes.
  std::array<Kept, 3> kept() const;
  /// The same in the data's own coordinates.
  double value(int axis, double percent) const;
  /// At least a hundredth of the box is kept.
  void keep(double now_s, int axis, Kept kept);
  /// Any order. Error: it is none.
  Status give(double now_s, const std::string& order);

 private:
  Give give_;
  scene::Placement placement_;
  std::string order_;
  struct Wish {
    std::string order;
    double since_s;
  };
  std::optional<Wish> wished_;
};

}  // namespace telesplat::viewer
