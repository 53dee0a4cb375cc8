#include "common/volume/warp/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/volume/warp/kernels.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "common/volume/warp/warp-inl.h"

#if HWY_ONCE
namespace telesplat::volume {

HWY_EXPORT(WarpParts);

uint64_t warp_tile(const WarpTile& tile) { return HWY_DYNAMIC_DISPATCH(WarpParts)(tile); }

}  // namespace telesplat::volume
#endif
