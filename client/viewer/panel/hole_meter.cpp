#include "client/viewer/panel/hole_meter.h"

#include <algorithm>
#include <limits>

namespace telesplat::viewer {

constexpr double kLines = 0.01;  // gaps between them over the object's pixels, at least

void HoleMeter::look_at(const image::View& view, uint32_t background) {
  Turn now;
  for (int y = turn_; y < view.height; y += kTurns) {
    const uint32_t* row = view.colour.data() + size_t(y) * size_t(view.width);
    int before = 0, gap = 0, run = 0;  // pixels: of the object, then of the background, then of the object
    const auto end_run = [&] {
      if (before > 0 && gap <= kWidest) (std::min(before, run) < gap ? now.between_lines : now.holes) += uint64_t(gap);
      now.object += uint64_t(run);
      before = run;
      gap = run = 0;
    };
    for (int x = 0; x < view.width; ++x) {
      if ((row[x] & 0xffffff) != background) {
        ++run;
        continue;
      }
      if (run > 0) end_run();
      ++gap;
    }
    if (run > 0) end_run();
  }
  turns_[size_t(turn_)] = now;
  turn_ = (turn_ + 1) % kTurns;
}

double HoleMeter::share() const {
  Turn sum;
  for (const Turn& t : turns_) sum.object += t.object, sum.holes += t.holes, sum.between_lines += t.between_lines;
  const bool lines = sum.between_lines > sum.holes && double(sum.between_lines) > kLines * double(sum.object);
  if (sum.object == 0 || lines) return std::numeric_limits<double>::quiet_NaN();
  return double(sum.holes) / double(sum.object + sum.holes);
}

}  // namespace telesplat::viewer
