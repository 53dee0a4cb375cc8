// Inputs and buffers of a kernel that splats one tile on the CPU (KernelTraits::splat_tile).
#pragma once

#include "common/splat/ewa/shading.h"
#include "common/splat/finish.h"
#include "common/splat/splat_kernels.h"
#include "common/splat/surfel/kernels.h"

namespace telesplat::splat {

/// The splatter owns all of it. The kernel writes only through `keys`, `tile` and `ewa`.
struct TileWork {
  const TileInput& input;

  // The frame.
  const ItemStyle* styles = nullptr;  ///< flat kernels: one an item
  const SurfelInput& surfels;         ///< surfel kernels
  const EwaLight& light;              ///< surfel kernels that shade

  // The thread. `keys` and `tile` are the same memory: Passes::kKeys leaves keys, Passes::kSums colours and infos.
  const KeyBuffer keys;
  const ResolvedTile& tile;
  int reach = 0;  ///< pixels around the tile that the finish reads
  EwaBuffer& ewa;
};

}  // namespace telesplat::splat
