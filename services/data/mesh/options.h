// How a mesh is read, placed and kept.
#pragma once

#include <optional>
#include <string>

#include "services/data/base/elevation_options.h"
#include "services/data/base/placement_options.h"

namespace telesplat::data {

/// What the store of a mesh depends on beside the mesh.
struct StoreOptions : PlacementOptions {
  std::string cache_dir;  ///< empty: $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat
  bool use_cache = true;
};

struct MeshOptions : StoreOptions {
  ElevationOptions elevation;  ///< of elevation rasters alone
  std::optional<double> iso;   ///< of volumes alone: the surface where they have this value
  std::string raw;             ///< with iso: VolumeSource::raw
};

}  // namespace telesplat::data
