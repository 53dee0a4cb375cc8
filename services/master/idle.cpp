#include "services/master/idle.h"

#include <algorithm>

namespace telesplat::master {

bool Idle::add(const std::string& id, int at_once) {
  auto s = std::find_if(samplers_.begin(), samplers_.end(), [&](const Sampler& x) { return x.id == id; });
  if (s == samplers_.end()) s = samplers_.insert(samplers_.end(), {id, 0, at_once});
  if (s->waiting >= kMaxWaitingLeases) return false;
  s->at_once = at_once;
  ++s->waiting;
  return true;
}

void Idle::remove(const std::string& id) {
  std::erase_if(samplers_, [&](const Sampler& s) { return s.id == id; });
}

void Idle::served(size_t i) {
  const auto place = samplers_.begin() + std::ptrdiff_t(i);
  if (--place->waiting > 0)
    std::rotate(place, place + 1, samplers_.end());
  else
    samplers_.erase(place);
}

bool Idle::served_in_place(size_t i) {
  if (--samplers_[i].waiting > 0) return true;
  samplers_.erase(samplers_.begin() + std::ptrdiff_t(i));
  return false;
}

}  // namespace telesplat::master
