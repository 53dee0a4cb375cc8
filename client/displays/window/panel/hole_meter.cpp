#include "client/displays/window/panel/hole_meter.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

namespace telesplat::viewer {
namespace {

constexpr double kLines = 0.01;  // gaps between them over the object's pixels, at least

// Whether the background around a pixel of it ends within kWidest pixels: a hole. Between lines it goes on along them.
bool is_closed(const image::View& view, uint32_t background, int x, int y) {
  constexpr int kReach = HoleMeter::kWidest, kSide = 2 * kReach + 1;
  std::array<bool, size_t(kSide * kSide)> seen{};
  std::vector<std::pair<int, int>> open{{0, 0}};
  while (!open.empty()) {
    const auto [dx, dy] = open.back();
    open.pop_back();
    const int px = x + dx, py = y + dy;
    if (px < 0 || py < 0 || px >= view.width || py >= view.height) return false;
    if ((view.colour[size_t(py) * size_t(view.width) + size_t(px)] & 0xffffff) != background) continue;
    if (std::max(std::abs(dx), std::abs(dy)) > kReach) return false;
    if (std::exchange(seen[size_t((dy + kReach) * kSide + dx + kReach)], true)) continue;
    for (const auto& [sx, sy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) open.emplace_back(dx + sx, dy + sy);
  }
  return true;
}

}  // namespace

void HoleMeter::look_at(const image::View& view, uint32_t background) {
  Turn now;
  for (int y = turn_; y < view.height; y += kTurns) {
    const uint32_t* row = view.colour.data() + size_t(y) * size_t(view.width);
    int before = 0, gap = 0, run = 0;  // pixels: of the object, then of the background, then of the object
    const auto end_run = [&](int x) {
      if (before > 0 && gap > 0 && gap <= kWidest) {
        if (std::min(before, run) < gap)
          now.between_lines += uint64_t(gap);
        else if (is_closed(view, background, x - run - 1, y))
          now.holes += uint64_t(gap);
      }
      now.object += uint64_t(run);
      before = run;
      gap = run = 0;
    };
    for (int x = 0; x < view.width; ++x) {
      if ((row[x] & 0xffffff) != background) {
        ++run;
        continue;
      }
      if (run > 0) end_run(x);
      ++gap;
    }
    if (run > 0) end_run(view.width);
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
