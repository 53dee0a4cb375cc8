#include "client/viewer/panel/hole_meter.h"

#include <limits>

namespace telesplat::viewer {

void HoleMeter::look_at(const image::View& view, uint32_t background) {
  Turn now;
  for (int y = turn_; y < view.height; y += kTurns) {
    const uint32_t* row = view.colour.data() + size_t(y) * size_t(view.width);
    int gap = kWidest + 1;  // background pixels since the last one of the object; there was none yet
    for (int x = 0; x < view.width; ++x) {
      if ((row[x] & 0xffffff) == background) {
        ++gap;
        continue;
      }
      if (gap <= kWidest) now.holes += uint64_t(gap);
      gap = 0;
      ++now.object;
    }
  }
  turns_[size_t(turn_)] = now;
  turn_ = (turn_ + 1) % kTurns;
}

double HoleMeter::share() const {
  Turn sum;
  for (const Turn& t : turns_) sum.object += t.object, sum.holes += t.holes;
  if (sum.object == 0) return std::numeric_limits<double>::quiet_NaN();
  return double(sum.holes) / double(sum.object + sum.holes);
}

}  // namespace telesplat::viewer
