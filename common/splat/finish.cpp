#include "common/splat/finish.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/splat/finish.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "common/core/within.h"
#include "common/splat/finish-inl.h"

#if HWY_ONCE
namespace telesplat::splat {
namespace {

// Mean of four channels at once: one function rounds down, one up, so that pictures become no darker.
uint32_t mean_down(uint32_t a, uint32_t b) { return (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); }
uint32_t mean_up(uint32_t a, uint32_t b) { return (a | b) - (((a ^ b) & 0xfefefefeu) >> 1); }

}  // namespace

HWY_EXPORT(FindContent);
HWY_EXPORT(FillHoles);
HWY_EXPORT(Smooth);
HWY_EXPORT(Antialias);

ResolvedTile crop_to_content(const ResolvedTile& tile, int reach) {
  return HWY_DYNAMIC_DISPATCH(FindContent)(tile, reach);
}
int fill_holes(const ResolvedTile& tile, int grow, Gaps gaps, FinishScratch& scratch) {
  return HWY_DYNAMIC_DISPATCH(FillHoles)(tile, grow, gaps, scratch);
}
void smooth(const ResolvedTile& tile, int grow, FinishScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(Smooth)(tile, grow, scratch);
}
void antialias(const ResolvedTile& tile, FinishScratch& scratch) { HWY_DYNAMIC_DISPATCH(Antialias)(tile, scratch); }

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
    uint32_t* out = doubled.data();  // a pointer: checked access would not be vectorised
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
#endif
