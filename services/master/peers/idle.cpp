#include "services/master/peers/idle.h"

#include <algorithm>

namespace telesplat::master {

bool Idle::add(const std::string& id, int at_once) {
  if (ids_.insert(id).second) {
    samplers_.push_back({id, 1, at_once});
    return true;
  }
  auto s = std::find_if(samplers_.begin(), samplers_.end(), [&](const Sampler& x) { return x.id == id; });
  if (s->waiting >= kMaxWaitingLeases) return false;
  s->at_once = at_once;
  ++s->waiting;
  return true;
}

void Idle::remove(const std::string& id) {
  if (ids_.erase(id)) std::erase_if(samplers_, [&](const Sampler& s) { return s.id == id; });
}

void Idle::served(size_t i) {
  if (--samplers_[i].waiting == 0) return erase(i);
  Sampler last = std::move(samplers_[i]);
  samplers_.erase(samplers_.begin() + std::ptrdiff_t(i));
  samplers_.push_back(std::move(last));
}

bool Idle::served_in_place(size_t i) {
  if (--samplers_[i].waiting > 0) return true;
  erase(i);
  return false;
}

void Idle::erase(size_t i) {
  ids_.erase(samplers_[i].id);
  samplers_.erase(samplers_.begin() + std::ptrdiff_t(i));
}

}  // namespace telesplat::master
