#include "common/splat/finish.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/splat/finish.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "common/splat/finish-inl.h"

#if HWY_ONCE
namespace telesplat::splat {

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

}  // namespace telesplat::splat
#endif
