// Elevation rasters (GeoTIFF, HGT, 16-bit PNG and others that GDAL reads) as coloured height fields.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// z_scale multiplies heights; 0: 1 where the raster is georeferenced, else a factor that makes the relief a seventh of
/// the longer side.
struct ElevationOptions {
  double z_scale = 0;
  std::string texture;  ///< an image draped over the raster (orthophoto), path; empty: coloured by height
};

inline constexpr int64_t kMaxRasterSamples = int64_t{1} << 26;  ///< vertices; larger rasters are read coarser

/// A regular grid of heights. Sample (column, row) stands at first + column * along_row + row * along_column: east and
/// north, metres (or pixels, if the file has no position).
struct ElevationRaster {
  int width = 0, height = 0;
  glm::dvec2 first{0}, along_row{1, 0}, along_column{0, -1};
  bool georeferenced = false;      ///< plan and heights have one unit
  scene::Coordinates coordinates;  ///< the file's, without z_scale
  int step = 1;                    ///< every step-th sample of the file
  std::vector<float> heights;      ///< row by row, metres; NaN: no data
  std::vector<uint32_t> colours;   ///< from a texture, 0x00RRGGBB, one per sample; empty: no texture
  std::vector<std::string> notes;  ///< as Mesh::notes
};

/// Makes two triangles per cell whose four corners have data, one where three have. x east, y north, z up. Colours are
/// the texture's, or tints by height: blue at and below sea level where the data have a coast, green to brown to white
/// over the 2nd to 98th percentile of the rest. Error, starting with `name`: fewer than 2 x 2 samples, no cell with
/// data, a z_scale that is not finite.
Result<Mesh> elevation_mesh(const ElevationRaster& raster, const ElevationOptions& options, const std::string& name);

}  // namespace telesplat::data
