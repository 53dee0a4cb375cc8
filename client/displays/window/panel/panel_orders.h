// Orders of a window: to the session's master, with the undo of those that change the picture.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/displays/window/input/undo.h"
#include "client/displays/window/panel/control_desk.h"
#include "client/displays/window/panel/order_undo.h"

namespace telesplat::viewer {

/// Used by one thread. Neither call waits.
class PanelOrders {
 public:
  static constexpr const char* kProbe = "probe";  ///< asks for a value, and changes nothing

  PanelOrders(std::string master, net::Access access) : desk_(std::move(master), std::move(access)) {}

  void on_session(std::shared_ptr<const wire::Welcome> session) { undo_.on_session(std::move(session)); }
  /// undoes: it undoes or redoes another order.
  void give(Order order, bool undoes = false) {
    if (order.command != kProbe) undo_.given(order, undoes);
    desk_.give(std::move(order));
  }
  /// Returns the answers since the last call. Orders that were obeyed can be undone from now on.
  std::vector<OrderAnswer> take_answers(double now_s, UndoStack& undo) {
    auto answers = desk_.take_answers();
    for (const auto& [order, obeyed, text] : answers) {
      const auto back = order.command == kProbe ? std::nullopt : undo_.answered({order, obeyed, text});
      if (back)
        undo.did(now_s, {order.command, [this, back] { give(*back, true); },
                         [this, again = order] { give(again, true); }, order.subject});
    }
    return answers;
  }
  /// ControlDesk::watch() and take_news().
  void watch(bool watches) { desk_.watch(watches); }
  std::optional<ControlDesk::News> take_news() { return desk_.take_news(); }

 private:
  ControlDesk desk_;
  OrderUndo undo_;
};

}  // namespace telesplat::viewer
