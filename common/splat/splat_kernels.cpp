#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/splat/splat_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "common/splat/splat_kernels-inl.h"

#if HWY_ONCE
namespace telesplat::splat {

HWY_EXPORT(SplatTile);
HWY_EXPORT(ResolveTile);
HWY_EXPORT(DepthTile);
HWY_EXPORT(TargetName);

TileCounts splat_tile(const TileInput& input, const SplatShape* const* shapes, const uint8_t* intensity,
                      const KeyBuffer& buffer) {
  return HWY_DYNAMIC_DISPATCH(SplatTile)(input, shapes, intensity, buffer);
}

void resolve_tile(const KeyBuffer& buffer, int width, int height, uint32_t background, uint32_t* colour, float* depth_m,
                  size_t pitch) {
  HWY_DYNAMIC_DISPATCH(ResolveTile)(buffer, width, height, background, colour, depth_m, pitch);
}

void depth_tile(const TileInput& input, uint32_t* depth_bits) { HWY_DYNAMIC_DISPATCH(DepthTile)(input, depth_bits); }

const char* kernel_target() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace telesplat::splat
#endif
