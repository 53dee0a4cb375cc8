// Sends the panel's orders to the session's master, in a thread of its own: the display never waits for an answer.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/displays/window/panel/session_status.h"
#include "common/net/keys/access.h"

namespace telesplat::viewer {

class ControlDesk {
 public:
  static constexpr double kPatience_s = 5;      ///< time to wait for an answer
  static constexpr double kStatusPeriod_s = 1;  ///< while watch() is on

  /// access: orders that change the session for all need an operator's key, if there are keys.
  ControlDesk(std::string master, net::Access access, double patience_s = kPatience_s);
  /// Does not wait for open answers.
  ~ControlDesk();

  // ---- any thread; none of these waits ----
  /// Orders go out in the order of the calls, one at a time (Order::subject).
  void give(Order order);
  /// watches: ask for the session's status every kStatusPeriod_s.
  void watch(bool watches);
  std::vector<OrderAnswer> take_answers();
  struct News {
    std::optional<SessionStatus> status;
    std::string problem;  ///< without a status: the reason
  };
  /// Returns the newest status since the last call.
  std::optional<News> take_news();

 private:
  struct Line;  // connection to the master
  void loop();
  bool waits_for_work(std::optional<Order>& order, bool& status);
  std::optional<OrderAnswer> ask(std::optional<Line>& to, Order order);

  const std::string master_;
  const net::Access access_;
  const double patience_s_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Order> orders_;
  std::vector<OrderAnswer> answers_;
  std::optional<News> news_;
  bool watches_ = false, stop_ = false;
  double status_due_s_ = 0;
  std::thread thread_;
};

}  // namespace telesplat::viewer
