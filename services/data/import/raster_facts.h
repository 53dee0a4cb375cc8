// Description of an elevation raster's file, for users.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/data/base/mesh.h"

namespace telesplat::data {

struct RasterFacts {
  std::string format;         ///< in GDAL's words: "GeoTIFF"
  std::string type;           ///< type of samples, in GDAL's words: "Int16"
  int width = 0, height = 0;  ///< samples in the file
  int step = 1;               ///< every step-th sample is read
  std::string reference;      ///< name of the coordinates' reference system: "WGS 84 / UTM zone 10N"; empty: not given
  std::string unit;           ///< "degrees", "metres" or another length; empty: no position is given
  /// Edges and a sample's size, in that unit; without a unit in samples.
  double west = 0, south = 0, east = 0, north = 0, sample_x = 1, sample_y = 1;
  double sample_x_m = 1, sample_y_m = 1;  ///< in metres, as shown; without a unit 1
  double lo = 0, hi = 0;                  ///< heights in metres, of the read samples
  std::string height_unit;                ///< unit of the file's heights; empty: no position is given
  double height_m = 1;                    ///< length of that unit, m
  uint64_t without_data = 0;              ///< read samples without data
};

/// Reads the description with GDAL, in the program telesplat-import. files: the raster, then its companions. Errors
/// name the file.
Result<RasterFacts> inspect_raster(const std::vector<std::string>& files);

/// Puts the description into a mesh's notes, in that program: read by inspect_raster().
Mesh to_notes(const RasterFacts& facts);

}  // namespace telesplat::data
