#include "client/viewer/wall_pace.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

constexpr double kAsk_s = 0.1;        // period of checks for a stop
constexpr double kSayAgain_s = 0.25;  // SwapReady may have been lost
constexpr double kFarAway_s = 1;      // a moment to present that lies farther ahead is ignored

}  // namespace

WallPace::WallPace(net::Context& context, const Options& options, std::function<InstanceId()> viewer,
                   std::function<double(double)> to_master_s)
    : options_(options),
      viewer_(std::move(viewer)),
      to_master_s_(std::move(to_master_s)),
      socket_(context, net::Kind::kDealer, options.name + ":wall", {.linger_ms = 0}) {
  if (const Status s = socket_.connect(options.master); !s) log::error("{}", s.error().text);
}

// Returns the newest word for the frame at hand or a later one. waited: it came in a wait; measures its delay.
std::optional<wire::Swap> WallPace::take(bool waited) {
  std::optional<wire::Swap> out;
  while (const auto message = socket_.receive()) {
    if (message->type != wire::Swap::kName) {
      socket_.reject(*message, "its type is not expected here");
      continue;
    }
    auto swap = socket_.decode<wire::Swap>(*message);
    // A restarted master may not know how far the wall is: its numbers count from now on.
    if (!swap || (swap->master == led_by_ && swap->frame < turn_.frame)) continue;
    if (waited) late_s_ = std::clamp(to_master_s_(message->arrived_s) - swap->at_s, 0.0, kFarAway_s);
    out = std::move(swap);
  }
  return out;
}

std::optional<wire::Swap> WallPace::wait(const wire::SwapReady& ready, double patience_s,
                                         const std::function<bool()>& stopped) {
  const double begin_s = monotonic_s();
  double said_s = begin_s;
  socket_.send(ready);
  if (auto swap = take(false)) return swap;
  for (double now_s = begin_s; now_s < begin_s + patience_s; now_s = monotonic_s()) {
    if (stopped()) return std::nullopt;
    net::wait_readable_s({&socket_}, std::min(kAsk_s, begin_s + patience_s - now_s));
    if (auto swap = take(true)) return swap;
    if (monotonic_s() - said_s < kSayAgain_s) continue;
    said_s = monotonic_s();
    socket_.send(ready);
  }
  return std::nullopt;
}

bool WallPace::asks(double now_s, const Wish& next) const {
  return next.horizon_s > 0 && options_.asks_hz > 0 && now_s + options_.period_s / 2 >= ask_due_s_;
}

void WallPace::take_ask(const wire::Swap& swap, Swapped& out) {
  if (swap.ask == 0 || (swap.master == asked_by_ && swap.ask == asked_)) return;
  asked_by_ = swap.master;
  asked_ = out.ask = swap.ask;
  out.ask_head = swap.ask_head;
  const double now_s = monotonic_s(), period_s = 1 / options_.asks_hz;
  ask_due_s_ = now_s - ask_due_s_ < period_s ? ask_due_s_ + period_s : now_s + period_s;
}

WallPace::Swapped WallPace::drawn(const Wish& next, const std::function<bool()>& stopped) {
  const double begin_s = monotonic_s();
  late_s_ = begun_ ? late_s_ : 0;
  predictor_.add(begin_s, next.head);
  const wire::SwapReady ready{.viewer = viewer_(),
                              .wall = options_.wall,
                              .number = options_.number,
                              .viewers = options_.viewers,
                              .frame = turn_.frame,
                              .t_s = next.t_s,
                              .head = next.head,
                              .state = next.state,
                              .period_s = options_.period_s,
                              .presented = presented_,
                              .presented_s = presented_s_,
                              .late_s = std::exchange(late_s_, 0),
                              .asks = asks(begin_s, next),
                              .ahead = predictor_.predict(begin_s + next.horizon_s)};
  const double patience_s = alone_ ? 0 : begun_ ? kPatience_s + 2 * options_.period_s : kFirstPatience_s;
  const auto swap = wait(ready, patience_s, stopped);
  begun_ = true;
  Swapped out;
  drawn_ = turn_.frame;
  if (!swap) {
    if (!alone_ && !stopped()) log::warn("the master does not say when the wall's frames are presented: alone for now");
    out.alone = alone_ = true;
    out.wait_s = monotonic_s() - begin_s;
    // The number stays: the next master to lead the wall then sends where the wall is.
    turn_ = {turn_.frame, next.t_s, next.head, next.state};
    return out;
  }
  if (std::exchange(alone_, false)) log::info("the wall's frames are presented together again");
  const double offset_s = to_master_s_(begin_s) - begin_s, at_s = swap->at_s - offset_s;
  if (at_s - monotonic_s() < kFarAway_s) sleep_until(at_s);
  led_by_ = swap->master;
  turn_ = {swap->frame + 1, swap->t_s, swap->head, swap->state};
  out.wait_s = monotonic_s() - begin_s;
  out.skew_frame = swap->skew_frame;
  out.skew_s = swap->skew_s;
  take_ask(*swap, out);
  return out;
}

void WallPace::presented(double now_s) {
  if (alone_ || drawn_ == 0) return;
  presented_ = drawn_;
  presented_s_ = to_master_s_(now_s);
}

}  // namespace telesplat::viewer
