// Reading elevation rasters with GDAL, in the program telesplat-import only: it may throw or crash on hostile files.
#pragma once

#include <string>

#include "services/data/base/elevation.h"
#include "services/data/import/files.h"
#include "services/data/import/raster_facts.h"

namespace telesplat::data {

/// Reads the raster `path` and the picture `texture` (empty: none), both among `files`. Errors name the file: no
/// raster, several bands (a picture), more samples than memory.
Result<ElevationRaster> read_elevation(ImportFiles& files, const std::string& path, const std::string& texture);

/// What it says of itself, and the heights that it holds.
Result<RasterFacts> read_raster_facts(ImportFiles& files, const std::string& path);

}  // namespace telesplat::data
