#include "client/displays/window/panel/control_desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/core/clock.h"
#include "common/core/guarded.h"
#include "common/net/control.h"
#include "common/net/service.h"

namespace telesplat::viewer {
namespace {

constexpr double kLook_s = 0.05;  // longest time until a stop is noticed

std::chrono::duration<double> seconds(double s) { return std::chrono::duration<double>(s); }

}  // namespace

struct ControlDesk::Line {
  net::Context context;
  net::Socket socket;
  Status connected;
  explicit Line(const std::string& master, const net::Access& access)
      : context(access),
        socket(context, net::Kind::kDealer, "panel", net::kControlSocket),
        connected(socket.connect(master)) {}
};

ControlDesk::ControlDesk(std::string master, net::Access access, double patience_s)
    : master_(std::move(master)), access_(std::move(access)), patience_s_(patience_s), thread_([this] { loop(); }) {}

ControlDesk::~ControlDesk() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void ControlDesk::give(Order order) {
  {
    const std::lock_guard lock(mutex_);
    const auto same = std::find_if(orders_.begin(), orders_.end(), [&](const Order& o) {
      return !order.subject.empty() && o.subject == order.subject && o.command == order.command;
    });
    if (same != orders_.end())
      *same = std::move(order);
    else
      orders_.push_back(std::move(order));
  }
  changed_.notify_one();
}

void ControlDesk::watch(bool watches) {
  {
    const std::lock_guard lock(mutex_);
    if (watches_ == watches) return;
    watches_ = watches;
  }
  changed_.notify_one();
}

std::vector<OrderAnswer> ControlDesk::take_answers() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answers_, {});
}

std::optional<ControlDesk::News> ControlDesk::take_news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, std::nullopt);
}

// Waits for an order to send, or until a status is due. False: stop.
bool ControlDesk::waits_for_work(std::optional<Order>& order, bool& status) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (stop_) return false;
    if (!orders_.empty()) {
      order = std::move(orders_.front());
      orders_.pop_front();
      return true;
    }
    const double left_s = status_due_s_ - monotonic_s();
    if (watches_ && left_s <= 0) {
      status = true;
      return true;
    }
    if (watches_)
      changed_.wait_for(lock, seconds(left_s));
    else
      changed_.wait(lock);
  }
}

// nullopt: stop. An answer does not name its question: if one may still come, the connection is given up.
std::optional<OrderAnswer> ControlDesk::ask(std::optional<Line>& to, Order order) {
  // Connect only for an order: the master counts a connection without messages as a rejected message.
  if (!to) to.emplace(master_, access_);
  Line& line = *to;
  const auto failed = [&](std::string why) {
    to.reset();
    return OrderAnswer{order, false, std::move(why)};
  };
  if (!line.connected) return failed(line.connected.error().text);
  const uint64_t failed_before = line.socket.failed_connections();
  line.socket.send(wire::Control{order.command, order.arguments});
  for (const double until_s = monotonic_s() + patience_s_; monotonic_s() < until_s;) {
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return std::nullopt;
    }
    net::wait_readable_s({&line.socket}, kLook_s);
    while (const auto message = line.socket.receive()) {
      if (message->type != wire::ControlReply::kName) continue;
      if (const auto reply = line.socket.decode<wire::ControlReply>(*message))
        return OrderAnswer{std::move(order), reply->ok, reply->text};
    }
    if (std::string refusal = net::refusal_of_master(line.socket, master_); !refusal.empty())
      return failed(std::move(refusal));
    if (line.socket.failed_connections() != failed_before)
      return failed(fmt::format("no master is at {}: nothing takes connections there", master_));
  }
  return failed(fmt::format("the master at {} has not answered for {:.0f} s", master_, patience_s_));
}

void ControlDesk::loop() {
  net::lower_thread_priority(5);
  std::optional<Line> line;
  for (;;) {
    std::optional<Order> order;
    bool status = false;
    if (!waits_for_work(order, status)) return;
    const Order asked = order ? *std::move(order) : Order{"status", {}, {}};
    std::optional<OrderAnswer> answer;
    if (const Status s = guarded("asking the master", [&] { answer = ask(line, asked); }); !s) {
      line.reset();
      answer = OrderAnswer{asked, false, s.error().text};
    }
    if (!answer) return;
    const std::lock_guard lock(mutex_);
    if (!status) {
      answers_.push_back(*std::move(answer));
      continue;
    }
    status_due_s_ = monotonic_s() + kStatusPeriod_s;
    auto read = answer->obeyed ? read_status(answer->text) : Result<SessionStatus>(Error{answer->text});
    news_ = read ? News{*std::move(read), {}} : News{{}, read.error().text};
  }
}

}  // namespace telesplat::viewer
