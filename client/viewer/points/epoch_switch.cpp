#include "client/viewer/points/epoch_switch.h"

namespace telesplat::viewer {

void EpochSwitch::begin(EpochId epoch, bool held, double now_s) {
  newest_ = {};
  any_ = coarse_seen_ = coarse_complete_ = complete_ = own_complete_ = false;
  waiting_ = held;
  if (!held) since_s_.reset();
  if (epoch.value != 0) name(epoch, now_s);
}

void EpochSwitch::name(EpochId epoch, double now_s) {
  newest_ = epoch;
  if (!waiting_)
    displayed_ = epoch;
  else if (epoch != displayed_ && !since_s_)
    since_s_ = now_s;
}

void EpochSwitch::on_part(const Part& part, double now_s) {
  if (newest_.value == 0) name(part.epoch, now_s);
  any_ = true;
  if (part.step > 1) {
    coarse_seen_ = true;
    coarse_complete_ |= part.frame_complete;
  } else if (part.frame_complete) {
    complete_ = true;
    own_complete_ |= part.own;
  }
}

bool EpochSwitch::due(double now_s) const {
  if (!waiting_) return false;
  if (own_complete_ || (complete_ && newest_ == displayed_)) return true;
  if (!since_s_ || now_s < *since_s_ + patience_s_) return false;
  return complete_ || coarse_complete_ || (any_ && !coarse_seen_);
}

void EpochSwitch::shown() {
  waiting_ = false;
  displayed_ = newest_;
  since_s_.reset();
}

}  // namespace telesplat::viewer
