// How elevation rasters are shown.
#pragma once

#include <string>

namespace telesplat::data {

/// Heights are multiplied by z_scale; 0: by 1 where the raster is georeferenced, else so that the relief is a seventh
/// of the longer side.
struct ElevationOptions {
  double z_scale = 0;
  std::string texture;  ///< an image draped over the raster (orthophoto), path; empty: coloured by height
};

}  // namespace telesplat::data
