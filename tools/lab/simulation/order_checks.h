// Checks of a session's orders: each is answered, wrong ones are refused, and the last one of each setting holds.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "common/wire/messages.h"
#include "tools/lab/simulation/excuses.h"

namespace telesplat::simulation {

/// Returns a fact of the session; empty: it has none of this name.
std::string fact_of(const wire::Welcome& session, const std::string& name);

class OrderChecks {
 public:
  using Fail = std::function<void(const std::string& text)>;
  /// duration_s: of the session; statuses of its last kLast_s are kept.
  OrderChecks(double duration_s, Fail fail) : duration_s_(duration_s), fail_(std::move(fail)) {}
  static constexpr double kLast_s = 1.5;

  /// The event begins the next peer that speaks.
  void on_event(const Event& event) { speaker_ = event; }
  void on_order(int process, const wire::Control& order, double now_s) { open_[process] = {now_s, order, speaker_}; }
  void on_reply(int process, const wire::ControlReply& reply, double sent_s, double now_s);
  void on_welcome(const wire::Welcome& welcome, double now_s);
  void on_new_master();

  /// The session as its master told it last.
  const wire::Welcome& session() const { return session_; }
  /// The master's last answer to `status`, JSON; empty: there was no answer.
  const std::string& status() const { return status_; }
  /// True if orders have changed a Julia set: it may have left the view, or change for ever.
  bool reshaped() const;
  /// The newest epoch that each viewer must show by now; 0: no epoch is that old.
  uint64_t due_epoch(double now_s, const Excuses& excuses) const;
  /// Fails for orders that wait for too long.
  void look_at_open(double now_s, const Excuses& excuses) const;
  /// Fails if the master's session, or `known`, has another value than the last order of it. name: of who knows it.
  void look_at_values() const;
  void look_at_values(const wire::Welcome& known, const std::string& name) const;

 private:
  struct Open {
    double at_s = 0;
    wire::Control order;
    Event speaker;
  };
  struct Value {
    double at_s = 0;
    std::string text;  // empty: not known
  };
  const double duration_s_;
  const Fail fail_;
  std::map<int, Open> open_;             // by process of the speaker
  std::map<std::string, Value> values_;  // that orders changed
  wire::Welcome session_;
  double scene_since_s_ = 0;
  std::deque<std::pair<double, uint64_t>> epochs_;  // when this master's epochs began, and their numbers
  std::string status_;
  Event speaker_;
};

}  // namespace telesplat::simulation
