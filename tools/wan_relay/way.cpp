#include "tools/wan_relay/way.h"

#include <algorithm>
#include <chrono>

#include "common/core/clock.h"

namespace telesplat::wan_relay {

Timer::time_point time_point(double monotonic_s) {
  return Timer::time_point(std::chrono::duration_cast<Timer::duration>(std::chrono::duration<double>(monotonic_s)));
}

Way::Way(Context& context, const links::Link& link, double from_s, uint32_t seed)
    : shaper_(link, from_s, seed), timer_(context) {}

void Way::join(const std::shared_ptr<Sender>& sender) {
  waiting_.push_back(sender);
  if (!timing_) let_in();
}

double Way::pass(double now_s, size_t bytes) {
  bytes_ += bytes;
  const double out_s = shaper_.pass(now_s, bytes);
  most_queued_ = std::max(most_queued_, shaper_.queued(now_s));
  return out_s;
}

void Way::let_in() {
  timing_ = false;
  while (!waiting_.empty()) {
    if (shaper_.room(monotonic_s()) < shaper_.piece()) break;
    const auto sender = waiting_.front().lock();
    waiting_.pop_front();
    if (sender) sender->send_piece();
  }
  if (waiting_.empty() || timing_) return;
  timing_ = true;
  timer_.expires_at(time_point(shaper_.room_at_s()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) let_in();
  });
}

}  // namespace telesplat::wan_relay
