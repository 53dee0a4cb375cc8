#include "common/net/connections/peer_rates.h"

#include <algorithm>

namespace telesplat::net {

namespace {

constexpr size_t kMostBuckets = 4096;
constexpr double kBurst_s = 2;  // burst, in seconds of the rate
constexpr double kIdle_s = 5;

}  // namespace

bool PeerRates::admit(const std::string& peer, double now_s) {
  auto bucket = peers_.find(peer);
  if (bucket == peers_.end()) {
    if (peers_.size() >= kMostBuckets) forget_idle(now_s);
    // Beyond kMostBuckets, all further peers share one bucket.
    const std::string& whose = peers_.size() < kMostBuckets ? peer : std::string();
    bucket = peers_.try_emplace(whose, rate_, kBurst_s * rate_).first;
  }
  if (bucket->second.take(now_s)) return true;
  ++refused_;
  return false;
}

void PeerRates::forget_idle(double now_s) {
  if (now_s - forgot_s_ < 1) return;
  forgot_s_ = now_s;
  std::erase_if(peers_, [&](const auto& p) { return now_s - p.second.last_s() > kIdle_s; });
}

namespace {

constexpr double kForgets_s = 1;  // forgets payers without debt this often

}  // namespace

double WorkShares::owed_s(const Owed& owed, double now_s) const {
  return std::max(0.0, owed.seconds - kShare * std::max(0.0, now_s - owed.at_s));
}

bool WorkShares::admit(const std::string& payer, double now_s) {
  const auto found = owed_.find(payer);
  if (found == owed_.end() || owed_s(found->second, now_s) < kBurst_s) return true;
  ++refused_;
  return false;
}

void WorkShares::worked(const std::string& payer, double seconds, double now_s) {
  Owed& owed = owed_[payer];
  owed = {owed_s(owed, now_s) + seconds, now_s};
  if (now_s - forgot_s_ < kForgets_s) return;
  forgot_s_ = now_s;
  std::erase_if(owed_, [&](const auto& o) { return owed_s(o.second, now_s) == 0; });
}

}  // namespace telesplat::net
