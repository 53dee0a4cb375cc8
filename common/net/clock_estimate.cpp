#include "common/net/clock_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace telesplat::net {
namespace {

constexpr size_t kMostExchanges = 512;
constexpr size_t kLeastForDrift = 8;
constexpr double kMostDrift = 500e-6;    // what an operating system corrects at most
constexpr double kLeastError_s = 20e-6;  // reading clocks and waking up take their time
constexpr double kSigmas = 3;            // of the line's slope

}  // namespace

void ClockEstimate::clear() { *this = {}; }

void ClockEstimate::add(const ClockExchange& e) {
  const Seen seen{(e.sent_s + e.arrived_s) / 2, e.offset_s(), e.round_trip_s()};
  if (!std::isfinite(seen.offset_s) || !std::isfinite(seen.at_s) || !(seen.round_trip_s >= 0) ||
      e.replied_s < e.received_s)
    return;
  if (!exchanges_.empty() && seen.at_s < exchanges_.back().at_s) return;  // an answer that was overtaken
  exchanges_.push_back(seen);
  while (exchanges_.size() > kMostExchanges || exchanges_.front().at_s < seen.at_s - kMemory_s) exchanges_.pop_front();
  estimate_drift();
}

// A line through the offsets by least squares. An exchange counts by its round trip: half of it is how wrong it may be.
void ClockEstimate::estimate_drift() {
  drift_ = 0, drift_error_ = kUnknownDrift;
  if (exchanges_.size() < kLeastForDrift || exchanges_.back().at_s - exchanges_.front().at_s < kDriftAfter_s) return;
  const auto weight = [](const Seen& s) { return 1 / std::pow(std::max(s.round_trip_s / 2, kLeastError_s), 2); };
  double weights = 0, t = 0, o = 0, tt = 0, to = 0;
  for (const Seen& s : exchanges_) {
    const double w = weight(s);
    weights += w, t += w * s.at_s, o += w * s.offset_s;
  }
  t /= weights, o /= weights;
  for (const Seen& s : exchanges_) {
    const double w = weight(s);
    tt += w * (s.at_s - t) * (s.at_s - t), to += w * (s.at_s - t) * (s.offset_s - o);
  }
  const double error = kWander + kSigmas / std::sqrt(tt);
  if (!(error < kUnknownDrift)) return;
  drift_ = std::clamp(to / tt, -kMostDrift, kMostDrift);
  drift_error_ = error;
}

double ClockEstimate::error_s(const Seen& seen, double local_s) const {
  return std::max(seen.round_trip_s / 2, kLeastError_s) + drift_error_ * std::abs(local_s - seen.at_s);
}

const ClockEstimate::Seen& ClockEstimate::best(double local_s) const {
  return *std::min_element(exchanges_.begin(), exchanges_.end(),
                           [&](const Seen& a, const Seen& b) { return error_s(a, local_s) < error_s(b, local_s); });
}

double ClockEstimate::offset_s(double local_s) const {
  if (same_ || !known()) return 0;
  const Seen& seen = best(local_s);
  return seen.offset_s + drift_ * (local_s - seen.at_s);
}

double ClockEstimate::error_s(double local_s) const {
  if (same_) return 0;
  return known() ? error_s(best(local_s), local_s) : std::numeric_limits<double>::infinity();
}

double ClockEstimate::round_trip_s() const {
  double out = !exchanges_.empty() ? exchanges_.front().round_trip_s : 0;
  for (const Seen& s : exchanges_) out = std::min(out, s.round_trip_s);
  return out;
}

}  // namespace telesplat::net
