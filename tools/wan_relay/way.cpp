#include "tools/wan_relay/way.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "common/core/check.h"
#include "common/core/clock.h"

namespace telesplat::wan_relay {
namespace {

constexpr double kPiece_s = 1e-3;
constexpr size_t kLeastPiece = 512, kMostPiece = 64 << 10, kUnlimitedQueue = 16 << 20;
// Delays of real links wander: jitter moves evenly from one random value to the next in this time.
constexpr double kJitterPeriod_s = 0.02;

}  // namespace

Shaper::Shaper(const links::Link& link, double from_s, uint32_t seed)
    : link_(link), from_s_(from_s), random_(seed + 1) {
  piece_ = kMostPiece;
  capacity_ = kUnlimitedQueue;
  if (link.rate_bit_s <= 0) return;
  piece_ = std::clamp(size_t(link.rate_bit_s / 8 * kPiece_s), kLeastPiece, kMostPiece);
  capacity_ = std::max(size_t(links::queue_bytes(link)), 2 * piece_);
}

void Shaper::drop_passed(double now_s) {
  while (!queue_.empty() && queue_.front().end_s <= now_s) {
    queued_ -= queue_.front().bytes;
    queue_.pop_front();
  }
}

size_t Shaper::queued(double now_s) {
  drop_passed(now_s);
  return queued_;
}

size_t Shaper::room(double now_s) { return capacity_ - queued(now_s); }

// Returns the end of the stall at t_s; without a stall t_s.
double Shaper::end_of_stall(double t_s) const {
  if (link_.stall_s <= 0) return t_s;
  const double k = std::floor((t_s - from_s_) / link_.stall_every_s);
  const double end_s = from_s_ + k * link_.stall_every_s + link_.stall_s;
  return k >= 1 && t_s < end_s ? end_s : t_s;
}

// Returns when the bottleneck has finished a piece that takes it `duration_s`; stalls do not count.
double Shaper::passed(double from_s, double duration_s) const {
  double t = end_of_stall(from_s);
  if (link_.stall_s <= 0) return t + duration_s;
  for (;;) {
    const double next_s =
        from_s_ + std::max(1.0, std::floor((t - from_s_) / link_.stall_every_s) + 1) * link_.stall_every_s;
    if (t + duration_s <= next_s) return t + duration_s;
    duration_s -= next_s - t;
    t = next_s + link_.stall_s;
  }
}

double Shaper::jitter(double now_s) {
  if (link_.jitter_s <= 0) return 0;
  const auto draw = [&] { return std::uniform_real_distribution(0.0, link_.jitter_s)(random_); };
  if (now_s - jitter_from_s_ >= 2 * kJitterPeriod_s) {  // no bytes passed for long
    jitter_from_s_ = now_s;
    jitter_before_s_ = draw();
    jitter_after_s_ = draw();
  } else if (now_s - jitter_from_s_ >= kJitterPeriod_s) {
    jitter_from_s_ += kJitterPeriod_s;
    jitter_before_s_ = std::exchange(jitter_after_s_, draw());
  }
  const double share = std::clamp((now_s - jitter_from_s_) / kJitterPeriod_s, 0.0, 1.0);
  return jitter_before_s_ + share * (jitter_after_s_ - jitter_before_s_);
}

double Shaper::pass(double now_s, size_t bytes) {
  CHECK(bytes <= room(now_s));
  const double duration_s = link_.rate_bit_s > 0 ? double(bytes) * 8 / link_.rate_bit_s : 0;
  free_s_ = passed(std::max(now_s, free_s_), duration_s);
  if (bytes > 0 && free_s_ > now_s) {
    queue_.push_back({free_s_, bytes});
    queued_ += bytes;
  }
  last_out_s_ = std::max(last_out_s_, free_s_ + link_.rtt_s / 2 + jitter(free_s_));
  return last_out_s_;
}

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
