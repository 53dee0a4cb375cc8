#include "common/net/connections/work_shares.h"

#include <algorithm>

namespace telesplat::net {
namespace {

constexpr double kForgets_s = 1;  // so often it looks for those who owe nothing

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
