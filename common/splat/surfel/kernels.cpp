#include "common/splat/surfel/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/splat/surfel/kernels.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "common/splat/ewa/ewa-inl.h"
#include "common/splat/surfel/ellipse-inl.h"

#if HWY_ONCE
namespace telesplat::splat {

HWY_EXPORT(EllipseTile);
HWY_EXPORT(EwaTile);

TileCounts ellipse_tile(const TileInput& input, const SurfelInput& surfels, const KeyBuffer& buffer) {
  return HWY_DYNAMIC_DISPATCH(EllipseTile)(input, surfels, buffer);
}

TileCounts ewa_tile(const TileInput& input, const SurfelInput& surfels, const EwaLight& light, EwaBuffer& buffer,
                    const ResolvedTile& tile, int reach) {
  return HWY_DYNAMIC_DISPATCH(EwaTile)(input, surfels, light, buffer, tile, reach);
}

}  // namespace telesplat::splat
#endif
