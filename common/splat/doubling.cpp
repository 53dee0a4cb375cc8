#include "common/splat/doubling.h"

#include <algorithm>
#include <vector>

#include "common/core/within.h"

namespace telesplat::splat {
namespace {

// Means of four channels at once: one rounded down, one up, so that pictures become no darker.
uint32_t mean_down(uint32_t a, uint32_t b) { return (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); }
uint32_t mean_up(uint32_t a, uint32_t b) { return (a | b) - (((a ^ b) & 0xfefefefeu) >> 1); }

}  // namespace

void double_rows(const FrameTarget& half, const FrameTarget& to, int first, int last) {
  const auto row_of = [](auto* pixels, const FrameTarget& picture, int y) {
    return pixels + static_cast<size_t>(y) * picture.row();
  };
  std::vector<uint32_t> between(static_cast<size_t>(half.width) + 2), doubled(2 * static_cast<size_t>(half.width));
  for (int y = first; y < last; ++y) {
    const int near = y / 2, far = within(near + (y % 2 != 0 ? 1 : -1), 0, half.height - 1);
    const uint32_t* a = row_of(half.colour, half, near);
    const uint32_t* b = row_of(half.colour, half, far);
    uint32_t* row = between.data() + 1;
    for (int x = 0; x < half.width; ++x) row[x] = mean_down(a[x], mean_up(a[x], b[x]));
    row[-1] = row[0], row[half.width] = row[half.width - 1];
    uint32_t* out = doubled.data();  // checked access would not be vectorised
    for (int x = 0; x < half.width; ++x) {
      out[2 * x] = mean_up(row[x], mean_down(row[x], row[x - 1]));
      out[2 * x + 1] = mean_up(row[x], mean_down(row[x], row[x + 1]));
    }
    std::copy_n(doubled.data(), to.width, row_of(to.colour, to, y));
    if (!to.depth_m) continue;
    const float* from = row_of(half.depth_m, half, near);
    float* depth = row_of(to.depth_m, to, y);
    for (int x = 0; x < to.width; ++x) depth[x] = from[x / 2];
  }
}

}  // namespace telesplat::splat
