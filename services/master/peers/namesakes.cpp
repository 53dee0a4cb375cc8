#include "services/master/peers/namesakes.h"

#include <algorithm>

namespace telesplat::master {

void Namesakes::replaced(InstanceId instance, double now_s) {
  std::erase_if(replaced_, [&](const auto& r) { return now_s - r.second > kMemory_s; });
  if (replaced_.size() >= kMostKept)
    replaced_.erase(std::min_element(replaced_.begin(), replaced_.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; }));
  replaced_[instance] = now_s;
}

bool Namesakes::lives_on(InstanceId instance, double now_s) {
  const auto found = replaced_.find(instance);
  if (found == replaced_.end()) return false;
  const bool recent = now_s - found->second <= kMemory_s;
  replaced_.erase(found);
  return recent;
}

}  // namespace telesplat::master
