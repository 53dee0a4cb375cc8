// Takes back what the panel ordered: the same order with what the session had before.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "client/displays/window/panel/session_status.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// One thread.
class OrderUndo {
 public:
  void on_session(std::shared_ptr<const wire::Welcome> session) { session_ = std::move(session); }

  /// The order that would take this one back now. Nothing: it does not change the picture, or it is not known what
  /// there was before.
  std::optional<Order> back_of(const Order& order) const;
  /// It is given. undoes: it takes another one back, or gives it again.
  void given(const Order& order, bool undoes = false);
  /// It was answered. Returns the order that takes it back, if it was obeyed and is a deed of its own.
  std::optional<Order> answered(const OrderAnswer& answer);

 private:
  struct Given {
    Order order;
    std::optional<Order> back;
  };
  std::shared_ptr<const wire::Welcome> session_;
  std::deque<Given> given_;  // and not answered, in their order
};

}  // namespace telesplat::viewer
