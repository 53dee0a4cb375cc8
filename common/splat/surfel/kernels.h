// The kernels `ellipse` and `ewa` inside one tile, on the widest vectors of the machine (Highway, chosen at run time).
// Every target computes the same pixels as the plain functions in ewa/shading.h and in the tests.
#pragma once

#include <hwy/aligned_allocator.h>

#include <cstddef>

#include "common/splat/ewa/shading.h"
#include "common/splat/splat_kernels.h"
#include "common/splat/surfel/splat.h"

namespace telesplat::splat {

/// Data of a view that these kernels need in addition to TileInput.
struct SurfelInput {
  SurfelCamera camera;
  const SurfelSource* sources = nullptr;  ///< one an item
  SpacingLimits limits{};
  float widest = 0;  ///< widest_contour(camera)
};

inline constexpr SurfelReach kEllipseReach{1.0f, 1.5f}, kEwaReach{1.6f, 2.0f};
static_assert(kEwaReach.growth * kEwaReach.growth >= kSupportGrowth);

/// Splats ellipses into buffer, whose pixels hold kEmptyKey or keys drawn before (pixel_key.h). One pass.
TileCounts ellipse_tile(const TileInput& input, const SurfelInput& surfels, const KeyBuffer& buffer);

/// Working memory of ewa, one a thread, kept from tile to tile: 36 bytes a pixel, and the splats between the two
/// passes. Between tiles `width` x `height` pixels are empty (visible: infinity, sums: 0). Splats hang over to the
/// right and below.
struct EwaBuffer {
  /// Splats kept between the passes; a tile with more processes its points twice. 72 bytes each.
  static constexpr size_t kRecordSplats = 32768;
  hwy::AlignedFreeUniquePtr<float[]> visible;  ///< per pixel: least depth code of its opaque ellipses
  hwy::AlignedFreeUniquePtr<float[]> sums;     ///< per pixel: 8, see EwaSum
  hwy::AlignedFreeUniquePtr<std::byte[]> record;
  int width = 0, height = 0, stride = 0;
  size_t pixels = 0;  ///< pixels that the arrays have room for
};

/// Splats `input.rect`, which is the tile and `reach` pixels around it, in two passes and writes it as shaded colours
/// and infos. Pixels within kFinishSlack to the right of it may change too. Depth codes carry no bias.
TileCounts ewa_tile(const TileInput& input, const SurfelInput& surfels, const EwaLight& light, EwaBuffer& buffer,
                    const ResolvedTile& tile, int reach);

}  // namespace telesplat::splat
