// How a mesh is read, placed and kept.
#pragma once

#include <optional>
#include <string>

#include "services/data/base/elevation.h"
#include "services/data/base/placement_options.h"
#include "services/data/base/volume.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {

/// What the store of a mesh depends on beside the mesh.
struct StoreOptions : PlacementOptions {
  std::string cache_dir;  ///< empty: $XDG_CACHE_HOME/telesplat, else ~/.cache/telesplat
  bool use_cache = true;
};

/// What a mesh is coloured by, as people give it.
struct ColouringOptions {
  std::string by;               ///< scene::parse_colour_by(); empty: the file's own colours
  bool by_file = false;         ///< `by` is what the file marks: its own colours count where that is no good
  std::string map = "viridis";  ///< colour::resolve_colour_map()
};

struct MeshOptions : StoreOptions {
  ElevationOptions elevation;                       ///< of elevation rasters alone
  uint64_t texture_detail = kDefaultTextureDetail;  ///< triangles, at most, of a mesh whose textures are baked
  ColouringOptions colouring;
  std::optional<double> iso;  ///< of volumes alone: the surface where they have this value
  VolumeLayout volume;        ///< with iso
};

}  // namespace telesplat::data
