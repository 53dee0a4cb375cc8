// What the file of an elevation raster says, for people.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/data/base/mesh.h"

namespace telesplat::data {

struct RasterFacts {
  std::string format;         ///< in GDAL's words: "GeoTIFF"
  std::string type;           ///< of samples, in GDAL's words: "Int16"
  int width = 0, height = 0;  ///< samples in the file
  int step = 1;               ///< every step-th of them is read
  std::string reference;      ///< name of the coordinates' reference system: "WGS 84 / UTM zone 10N"; empty: not said
  std::string unit;           ///< "degrees", "metres" or another length; empty: nothing says where it lies
  /// Edges and a sample's size, in that unit; without one in samples.
  double west = 0, south = 0, east = 0, north = 0, sample_x = 1, sample_y = 1;
  double sample_x_m = 1, sample_y_m = 1;  ///< in metres, as it is shown; without a unit 1
  double lo = 0, hi = 0;                  ///< heights in metres, of the samples that are read
  std::string height_unit;                ///< of the file's heights; empty: nothing says where it lies
  double height_m = 1;                    ///< of that unit
  uint64_t without_data = 0;              ///< of the samples that are read
};

/// Reads it with GDAL, in the program telesplat-import. files: the raster, then what lies beside it. Errors name the
/// file.
Result<RasterFacts> inspect_raster(const std::vector<std::string>& files);

/// That program's part: what it hands back has them as notes.
Mesh to_notes(const RasterFacts& facts);

}  // namespace telesplat::data
