// Undoes orders of the panel: gives the same order with the session's earlier value.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "client/displays/window/panel/session_status.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Used by one thread.
class OrderUndo {
 public:
  void on_session(std::shared_ptr<const wire::Welcome> session) { session_ = std::move(session); }

  /// Returns the order that would undo this one now. Nothing: it does not change the picture, or the earlier value is
  /// not known.
  std::optional<Order> back_of(const Order& order) const;
  /// The order is given. undoes: it undoes or redoes another one.
  void given(const Order& order, bool undoes = false);
  /// The order was answered. Returns the order that undoes it, if it was obeyed and is a deed of its own.
  std::optional<Order> answered(const OrderAnswer& answer);

 private:
  struct Given {
    Order order;
    std::optional<Order> back;
  };
  std::shared_ptr<const wire::Welcome> session_;
  std::deque<Given> given_;  // without an answer yet, in their order
};

}  // namespace telesplat::viewer
