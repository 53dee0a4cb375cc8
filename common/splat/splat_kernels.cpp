#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/splat/splat_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "common/splat/depth-inl.h"
#include "common/splat/flat/opaque-inl.h"
#include "common/splat/resolve-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {
const char* TargetName() { return hwy::TargetName(HWY_TARGET); }
}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::splat {

HWY_EXPORT(SplatTile);
HWY_EXPORT(ResolveTile);
HWY_EXPORT(WriteTile);
HWY_EXPORT(ResolveAndWriteTile);
HWY_EXPORT(DepthTile);
HWY_EXPORT(TargetName);

TileCounts splat_tile(const TileInput& input, const ItemStyle* styles, const KeyBuffer& buffer) {
  return HWY_DYNAMIC_DISPATCH(SplatTile)(input, styles, buffer);
}

void resolve_tile(const ResolvedTile& tile, int reach, const ResolveInput& input, std::vector<uint64_t>& scratch) {
  HWY_DYNAMIC_DISPATCH(ResolveTile)(tile, reach, input, scratch);
}

void write_tile(const ResolvedTile& tile, int reach, const ResolveInput& input, const TileTarget& target) {
  HWY_DYNAMIC_DISPATCH(WriteTile)(tile, reach, input, target);
}

void resolve_and_write_tile(const ResolvedTile& tile, const ResolveInput& input, const TileTarget& target) {
  HWY_DYNAMIC_DISPATCH(ResolveAndWriteTile)(tile, input, target);
}

void depth_tile(const TileInput& input, uint32_t* depth_bits) { HWY_DYNAMIC_DISPATCH(DepthTile)(input, depth_bits); }

const char* kernel_target() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace telesplat::splat
#endif
